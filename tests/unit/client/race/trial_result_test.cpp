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
