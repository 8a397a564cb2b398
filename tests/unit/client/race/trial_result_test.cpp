#include "client/race/trial_result.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

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

TEST(Flights, OfRacesWonAreComparedUpToTheirLastGate) {
  simulator::Report report;
  report.outcome = simulator::Outcome::kFinished;
  report.race_time_s = 1.25;
  report.samples.resize(3);
  for (std::size_t i = 0; i < 3; ++i) report.samples[i].t_s = 1.0 + 0.25 * static_cast<double>(i);
  const auto first = fingerprint(report);
  report.samples[2].state.p_WB.x() = 1.0;
  EXPECT_EQ(first, fingerprint(report)) << "the way out of the gate";
  report.samples[1].state.p_WB.x() = 1.0;
  EXPECT_NE(first, fingerprint(report));
  report.outcome = simulator::Outcome::kTouchedGate;
  const auto lost = fingerprint(report);
  report.samples[2].state.p_WB.x() = 2.0;
  EXPECT_NE(lost, fingerprint(report)) << "lost there: all of it counts";
}

TEST(Results, TellHowGatesWerePassedAndLapsFlown) {
  const Campaign campaign = campaign_of(kTwoCells);
  simulator::Report report;
  report.outcome = simulator::Outcome::kFinished;
  report.gates_total = 4;
  report.passes.resize(4);
  for (std::size_t i = 0; i < 4; ++i) report.passes[i].clearance_m = 0.1 * static_cast<double>(i + 1);
  report.lap_times_s = {4.0, 2.5, 3.0};
  report.missed_gates = 1;
  report.retries = 2;
  report.hull = config::HullKind::kSphere;
  const TrialResult result = to_result({&campaign.cells[0], 6, 7}, report);
  EXPECT_EQ(result.clearances_m, (std::vector<double>{0.1, 0.2, 0.1 * 3, 0.4}));
  EXPECT_EQ(result.median_lap_s, 3.0);
  EXPECT_EQ(result.slowest_lap_s, 4.0);
  EXPECT_EQ(result.missed, 1);
  EXPECT_EQ(result.retries, 2);
  EXPECT_EQ(result.hull, "sphere");
  EXPECT_TRUE(result.won()) << "a miss that was made good is no lost race";
}

TEST(Reproduction, NamesAllThatTheTrialNeeds) {
  const Campaign campaign = campaign_of(R"(
    cell { name: "a" scenario: "circle" laps: 2 speed_m_s: 6.5 profile: "paper" seeds { first: 1 last: 1 }
           link { each_way_ms: 25 jitter_ms: 4 loss: 0.05 outage_s: 1.5 } })");
  EXPECT_EQ(
      reproduce_command({&campaign.cells[0], 6.5, 42}),
      "gatefield-sim --lockstep --scenario cells/a.txt --seed 42 --speed 6.5 --profile paper --laps 2 --delay-ms 50 "
      "--jitter-ms 4 --loss 0.05 --outage-s 1.5");
}

}  // namespace
}  // namespace gatefield::race
