#include "server/pilot/diagnosis.h"

#include <gtest/gtest.h>

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;
using protocol::bit;
using protocol::Problem;
using protocol::Problems;

/// Steps every 10 ms from `from` for `how_long`; what the last one told.
Problems steps(Diagnosis* diagnosis, StepFindings findings, Stamp from, Stamp how_long) {
  Problems told = 0;
  for (Stamp t = from; t < from + how_long; t += 10ms) {
    findings.stamp = t;
    told = diagnosis->step(findings);
  }
  return told;
}

StepFindings good() {
  StepFindings findings;
  findings.effective_samples = 100.0;
  findings.gate_expected = findings.gate_seen = true;
  return findings;
}

TEST(Diagnosis, IsSilentWhenNothingIsWrong) {
  Diagnosis diagnosis;
  EXPECT_EQ(steps(&diagnosis, good(), 5s, 3s), 0u);
}

TEST(Diagnosis, TellsOfAFewSamplesAfterASecondWithoutABreak) {
  Diagnosis diagnosis;
  StepFindings starving = good();
  starving.effective_samples = 1.02;
  EXPECT_EQ(steps(&diagnosis, starving, 0s, 990ms), 0u);
  EXPECT_EQ(steps(&diagnosis, good(), 990ms, 10ms), 0u);
  EXPECT_EQ(steps(&diagnosis, starving, 1s, 1s), 0u) << "the wait began anew";
  EXPECT_EQ(steps(&diagnosis, starving, 2s, 100ms), bit(Problem::kFewEffectiveSamples));
  EXPECT_EQ(steps(&diagnosis, good(), 2100ms, 900ms), bit(Problem::kFewEffectiveSamples)) << "long enough to be read";
  EXPECT_EQ(steps(&diagnosis, good(), 3s, 200ms), 0u);
}

TEST(Diagnosis, TellsOfAGateThatIsNotSeenWhereItShouldBeUntilItIs) {
  Diagnosis diagnosis;
  StepFindings blind = good(), elsewhere = good();
  blind.gate_seen = elsewhere.gate_seen = elsewhere.gate_expected = false;
  EXPECT_EQ(steps(&diagnosis, blind, 0s, 600ms), 0u);
  EXPECT_EQ(steps(&diagnosis, elsewhere, 600ms, 5s), 0u) << "out of view nothing is expected";
  EXPECT_EQ(steps(&diagnosis, blind, 5600ms, 600ms), bit(Problem::kGateNotSeen));
  EXPECT_EQ(steps(&diagnosis, elsewhere, 6200ms, 10s), bit(Problem::kGateNotSeen));
  EXPECT_EQ(steps(&diagnosis, good(), 16200ms, 10ms), 0u);
}

TEST(Diagnosis, PassesOnWhatOthersFoundAndKeepsItForASecond) {
  Diagnosis diagnosis;
  StepFindings bad = good();
  bad.withheld = bit(Problem::kPlanThrust);
  bad.contradictions = bit(Problem::kThrustAgainstMotion);
  bad.depth_missing = bad.states_missing = bad.states_rejected = bad.frames_rejected = bad.stamps_jumped = true;
  bad.delay_long = true;
  bad.deadlines_missed = 3;
  const Problems all = bit(Problem::kPlanThrust) | bit(Problem::kThrustAgainstMotion) | bit(Problem::kDepthMissing) |
                       bit(Problem::kStatesMissing) | bit(Problem::kStatesRejected) | bit(Problem::kFramesRejected) |
                       bit(Problem::kStampsJump) | bit(Problem::kDelayLong) | bit(Problem::kDeadlinesMissed);
  EXPECT_EQ(steps(&diagnosis, bad, 0s, 10ms), all);
  StepFindings after = good();
  after.deadlines_missed = 3;
  EXPECT_EQ(steps(&diagnosis, after, 10ms, 900ms), all);
  EXPECT_EQ(steps(&diagnosis, after, 910ms, 200ms), 0u);
}

TEST(Diagnosis, BlamesNoCameraForStatesThatPutEveryImageElsewhere) {
  for (const Problem cause : {Problem::kStatesLookNed, Problem::kQuaternionLooksWFirst,
                              Problem::kVelocityLooksBodyFrame, Problem::kRatesLookWorldFrame}) {
    Diagnosis diagnosis;
    StepFindings bad = good();
    bad.sensing = bit(Problem::kMountingLooksWrong) | bit(Problem::kDepthUnitLooksWrong);
    EXPECT_EQ(steps(&diagnosis, bad, 0s, 250ms), 0u) << "states may yet contradict each other";
    EXPECT_EQ(steps(&diagnosis, bad, 250ms, 50ms), bad.sensing);
    bad.contradictions = bit(cause);
    EXPECT_EQ(steps(&diagnosis, bad, 300ms, 100ms), bit(cause));
  }
  Diagnosis diagnosis;
  StepFindings both = good();
  both.sensing = bit(Problem::kMountingLooksWrong);
  both.contradictions = bit(Problem::kRotorsLookSwapped);
  EXPECT_EQ(steps(&diagnosis, both, 0s, 300ms), both.sensing | both.contradictions) << "rotors move no image";
}

TEST(Diagnosis, ExpectsNothingWhenTheCourseIsDone) {
  Diagnosis diagnosis;
  StepFindings done = good();
  done.gate_seen = false;
  done.course_done = done.depth_missing = true;
  EXPECT_EQ(steps(&diagnosis, done, 0s, 3s), 0u);
}

TEST(Diagnosis, BeginsAnewWhenTheClockDoes) {
  Diagnosis diagnosis;
  StepFindings starving = good();
  starving.effective_samples = 1.0;
  steps(&diagnosis, starving, 100s, 2s);
  EXPECT_EQ(steps(&diagnosis, starving, 0s, 500ms), 0u);
  EXPECT_EQ(steps(&diagnosis, starving, 500ms, 600ms), bit(Problem::kFewEffectiveSamples));
}

}  // namespace
}  // namespace gatefield::pilot
