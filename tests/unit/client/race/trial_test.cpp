#include "client/race/trial.h"

#include <gmock/gmock.h>

#include <map>

#include "client/race/trial_result.h"
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

TEST(Trials, TruePosesNeedAServerForEachWorld) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 8 last: 9 } speed_m_s: 5 }
    cell { name: "learned" } cell { name: "true" perception: TRUE_POSE }
  )");
  const auto trials = trials_of(campaign);
  ASSERT_EQ(trials.size(), 4u);
  EXPECT_EQ(server_key(trials[0]), server_key(trials[1]));
  EXPECT_EQ(trials[2].cell, trials[3].cell);
  EXPECT_NE(server_key(trials[2]), server_key(trials[3]));
}

TEST(ShardText, IsIndexAndCount) {
  EXPECT_EQ(parse_shard("3/16")->index, 3);
  EXPECT_EQ(parse_shard("3/16")->count, 16);
  for (const char* bad : {"", "3", "0/4", "5/4", "1/0", "a/b", "1/2/3"})
    EXPECT_THAT(parse_shard(bad).ok() ? "" : parse_shard(bad).error(), HasSubstr("INDEX/COUNT")) << bad;
}

}  // namespace
}  // namespace gatefield::race
