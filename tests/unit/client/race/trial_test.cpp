#include "client/race/trial.h"

#include <gmock/gmock.h>

#include <map>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

std::multiset<std::string> names(const std::vector<Trial>& trials) {
  std::multiset<std::string> out;
  for (const Trial& trial : trials) out.insert(trial.name());
  return out;
}

TEST(Trials, EverySeedOfEverySpeedOfEveryCellOnce) {
  const Campaign campaign = campaign_of(kTwoCells);
  const auto trials = trials_of(campaign);
  EXPECT_EQ(trials.size(), 4u * 3u);
  const auto all = names(trials);
  EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), 12u);
  EXPECT_EQ(trials[0].name(), "a at 6 m/s, seed 5");
  EXPECT_EQ(trials[0].file_name(), "a-6-5");
  EXPECT_EQ(trials[3].seed, 6u) << "one seed of everything before the next";
}

TEST(Trials, ShardsHoldEveryTrialExactlyOnceAndAFairShareOfEveryCell) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 1 last: 48 } }
    cell { name: "a" speed_m_s: [5, 6, 7] }
    cell { name: "b" speed_m_s: 5 }
    cell { name: "c" speed_m_s: 5 seeds { first: 1 last: 12 } model: "other" }
  )");
  for (const int count : {1, 2, 3, 4, 7, 16}) {
    std::multiset<std::string> together;
    for (int index = 1; index <= count; ++index) {
      const auto mine = trials_of(campaign, {{index, count}, {}});
      together.merge(names(mine));
      std::map<std::string, int> slow;
      for (const Trial& trial : mine) ++slow[trial.cell->name];
      EXPECT_NEAR(slow["b"], 48.0 / count, 1.0) << index << "/" << count;
    }
    EXPECT_EQ(together, names(trials_of(campaign))) << count;
  }
}

TEST(Trials, ModelsAreFlownOneAfterTheOther) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 1 last: 3 } speed_m_s: 5 }
    cell { name: "a" model: "x" } cell { name: "b" model: "y" } cell { name: "c" model: "x" }
  )");
  std::string order;
  for (const Trial& trial : trials_of(campaign)) order += trial.cell->model;
  EXPECT_EQ(order, "xxxxxxyyy");
}

TEST(Trials, OtherSeedsReplaceTheCells) {
  const auto trials = trials_of(campaign_of(kTwoCells), {{}, SeedRange{100, 101}});
  EXPECT_EQ(trials.size(), 6u);
  EXPECT_EQ(trials.back().seed, 101u);
}

TEST(Trials, ThePlannersSeedIsThePersonsElseTheCellsElseGoesWithTheWorlds) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 8 last: 8 } speed_m_s: 5 }
    cell { name: "none" } cell { name: "said" planner_seed: 77 }
  )");
  const auto trials = trials_of(campaign);
  EXPECT_EQ(trials[0].seed_of_planner(), config::default_planner_seed(8));
  EXPECT_EQ(trials[1].seed_of_planner(), 77u);
  Selection selection;
  selection.planner_seed = 5;
  for (const Trial& trial : trials_of(campaign, selection)) {
    EXPECT_EQ(trial.seed, 8u);
    EXPECT_EQ(trial.seed_of_planner(), 5u);
    EXPECT_EQ(result_of(trial).planner_seed, 5u);
    EXPECT_THAT(reproduce_command(trial), HasSubstr(" --seed 8 --speed 5 --profile race --planner-seed 5"));
  }
  EXPECT_THAT(reproduce_command(trials[1]), testing::Not(HasSubstr("planner-seed"))) << "its scenario says it";
}

TEST(Trials, ACellOfOneSeedKeepsIt) {
  const auto trials = trials_of(campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 1 last: 3 } speed_m_s: 5 }
    cell { name: "many" } cell { name: "that-flight" seeds { first: 7 last: 7 } }
  )"),
                                {{}, SeedRange{100, 101}});
  ASSERT_EQ(trials.size(), 3u);
  EXPECT_EQ(trials[0].seed, 100u);
  EXPECT_EQ(trials[1].seed, 7u);
  EXPECT_EQ(trials[2].seed, 101u);
}

TEST(ShardText, IsIndexAndCount) {
  EXPECT_EQ(parse_shard("3/16")->index, 3);
  EXPECT_EQ(parse_shard("3/16")->count, 16);
  for (const char* bad : {"", "3", "0/4", "5/4", "1/0", "a/b", "1/2/3"})
    EXPECT_THAT(parse_shard(bad).ok() ? "" : parse_shard(bad).error(), HasSubstr("INDEX/COUNT")) << bad;
}

TEST(TrialLine, ComesBackAsItWas) {
  const Campaign campaign = campaign_of(kTwoCells);
  TrialResult result = result_of({&campaign.cells[1], 7.25, 6});
  result.sentence = "said \"this\", and that\nin two lines";
  result.setup = 0xfedcba9876543210ull;
  result.planner_seed = 99;
  result.clearance_m = std::nan("");
  result.cause = Cause::kPerceptionWrong;
  result.belief_error_m = 0.375;
  result.seen_before_s = std::nan("");
  const auto again = parse_csv_line(csv_line(result));
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(csv_line(*again), csv_line(result));
  EXPECT_EQ(again->sentence, "said \"this\", and that in two lines");
  EXPECT_EQ(again->failure, Failure::kPassedBeside);
  EXPECT_EQ(again->cause, Cause::kPerceptionWrong);
  EXPECT_DOUBLE_EQ(again->belief_error_m, 0.375);
  EXPECT_TRUE(std::isnan(again->seen_before_s));
  EXPECT_EQ(again->setup, result.setup);
  EXPECT_EQ(again->seed, 6u);
  EXPECT_EQ(again->planner_seed, 99u);
  EXPECT_EQ(again->flight, result.flight);
  EXPECT_TRUE(std::isnan(again->clearance_m));
  EXPECT_EQ(trial_name(*again), "b at 7.25 m/s, seed 6");
  const std::string header = csv_header();
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), 35);
}

TEST(TrialLine, WhatIsWrongIsNamed) {
  const Campaign campaign = campaign_of(kTwoCells);
  const std::string line = csv_line(result_of({&campaign.cells[0], 6, 7}));
  EXPECT_THAT(parse_csv_line("a,b").error(), HasSubstr("2 columns, expected 36"));
  std::string bad = line;
  bad.replace(bad.find(",7,"), 3, ",x,");
  EXPECT_THAT(parse_csv_line(bad).error(), HasSubstr("seed is 'x'"));
  bad = line;
  bad.replace(bad.find(",won,"), 5, ",owned,");
  EXPECT_THAT(parse_csv_line(bad).error(), HasSubstr("failure is 'owned'"));
}

TEST(Failures, AreSortedByWhatHappened) {
  simulator::Report report;
  report.passes.resize(2);
  report.passes.back().waypoint = 1;
  report.samples.resize(1);
  report.samples.back().expected_waypoint = 2;
  const auto kind = [&](simulator::Outcome outcome, int culprit = -1) {
    report.outcome = outcome;
    report.culprit = culprit;
    return failure_of(report);
  };
  using simulator::Outcome;
  EXPECT_EQ(kind(Outcome::kFinished), Failure::kNone);
  EXPECT_EQ(kind(Outcome::kTouchedGate, 2), Failure::kTargetGate);
  EXPECT_EQ(kind(Outcome::kTouchedGate, 1), Failure::kTargetGate) << "the gate it is still in";
  EXPECT_EQ(kind(Outcome::kTouchedGate, 3), Failure::kOtherObject);
  EXPECT_EQ(kind(Outcome::kTouchedFloor), Failure::kOtherObject);
  EXPECT_EQ(kind(Outcome::kTouchedClutter, 2), Failure::kOtherObject);
  EXPECT_EQ(kind(Outcome::kMissedGate, 2), Failure::kPassedBeside);
  EXPECT_EQ(kind(Outcome::kWrongDirection, 2), Failure::kWrongGate);
  EXPECT_EQ(kind(Outcome::kOutOfBounds), Failure::kLeftCourse);
  EXPECT_EQ(kind(Outcome::kStalled), Failure::kTimeout);
  EXPECT_EQ(kind(Outcome::kTimeLimit), Failure::kTimeout);
  EXPECT_EQ(kind(Outcome::kLostControl), Failure::kLostControl);
  EXPECT_EQ(kind(Outcome::kLinkLost), Failure::kLostServer);
}

TEST(Flights, AreTheSameOnlyBitForBit) {
  simulator::Report report;
  report.samples.resize(3);
  const auto first = fingerprint(report);
  EXPECT_EQ(first, fingerprint(report));
  report.samples[1].state.p_WB.x() = 1e-300;
  EXPECT_NE(first, fingerprint(report));
}

TEST(Reproduction, NamesAllThatTheTrialNeeds) {
  const Campaign campaign = campaign_of(R"(
    cell { name: "a" scenario: "circle" laps: 2 speed_m_s: 6.5 profile: "paper" seeds { first: 1 last: 1 }
           link { each_way_ms: 25 jitter_ms: 4 loss: 0.05 } })");
  EXPECT_EQ(
      reproduce_command({&campaign.cells[0], 6.5, 42}),
      "gatefield-sim --lockstep --scenario cells/a.txt --seed 42 --speed 6.5 --profile paper --laps 2 --delay-ms 50 "
      "--jitter-ms 4 --loss 0.05");
}

}  // namespace
}  // namespace gatefield::race
