// What a pilot tells of its problems, in commands and, when there is none, in telemetry.

#include <gtest/gtest.h>

#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using protocol::bit;
using protocol::Problem;
using protocol::Problems;
using testing::Bench;
using namespace std::chrono_literals;

/// Hovers 4 m before the first gate, a state and a frame every 20 ms. @return the newest command's problems
Problems hover(Bench* bench, Stamp from, Stamp how_long,
               const std::function<void(protocol::VehicleState*)>& spoil = nullptr) {
  Problems told = 0;
  for (Stamp stamp = from; stamp < from + how_long; stamp += 20ms) {
    auto frame = bench->frame(stamp);
    bench->take(frame);
    auto state = bench->state(stamp, {1, 0, 1.5});
    state.depth_sequence = bench->frame_sequence;
    if (spoil) spoil(&state);
    bench->take(state);
    if (bench->pilot->looking().due()) bench->look();
    if (const auto* const command = bench->step()) told = command->health.problems;
    bench->clock.advance(20ms);
  }
  return told;
}

TEST(PilotHealth, IsSilentWhenAllIsWell) {
  Bench bench;
  EXPECT_EQ(hover(&bench, 50s, 3s), 0u);
  EXPECT_EQ(bench.telemetry().health.problems, 0u);
}

TEST(PilotHealth, TellsWithinASecondOfAVelocityThatIsNotTheMotion) {
  Bench bench;
  const Problems told = hover(&bench, 50s, 1s, [](auto* state) { state->state.v_WB = {8, 0, 0}; });
  EXPECT_NE(told & bit(Problem::kVelocityAgainstMotion), 0u);
}

TEST(PilotHealth, TellsOfAGateThatIsNotSeenWhereItShouldBe) {
  Bench bench;
  bench.sensor->validity = bench.sensor->validity_anywhere = 0.1f;
  EXPECT_EQ(hover(&bench, 50s, 900ms), 0u);
  EXPECT_EQ(hover(&bench, 50900ms, 500ms), bit(Problem::kGateNotSeen));
  bench.sensor->validity = 0.9f;
  EXPECT_EQ(hover(&bench, 51400ms, 60ms), 0u);
}

TEST(PilotHealth, ExpectsNoGateBehindTheCameraOrFarAway) {
  Bench bench;
  bench.sensor->validity = bench.sensor->validity_anywhere = 0.1f;
  const auto about = [](auto* state) { state->state.q_WB = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()); };
  EXPECT_EQ(hover(&bench, 50s, 3s, about), 0u);
  Bench far;
  far.sensor->validity = far.sensor->validity_anywhere = 0.1f;
  const auto away = [](auto* state) { state->state.p_WB.x() = -5.0; };
  EXPECT_EQ(hover(&far, 50s, 3s, away), 0u);
}

TEST(PilotHealth, AWithheldPlanIsToldInTelemetryAndTheNextCommand) {
  Bench bench;
  hover(&bench, 50s, 100ms);
  bench.planner->not_finite = true;
  hover(&bench, 50100ms, 20ms);
  EXPECT_EQ(bench.pilot->problems(), bit(Problem::kPlanNotFinite));
  EXPECT_EQ(bench.telemetry().health.problems, bit(Problem::kPlanNotFinite));
  EXPECT_TRUE(bench.telemetry().health.degraded);
  bench.planner->not_finite = false;
  EXPECT_EQ(hover(&bench, 50120ms, 20ms), bit(Problem::kPlanNotFinite));
  EXPECT_EQ(hover(&bench, 50140ms, 1200ms), 0u);
  bench.planner->rate_n_s = 1e6;
  hover(&bench, 51340ms, 20ms);
  EXPECT_EQ(bench.pilot->problems(), bit(Problem::kPlanThrustRate));
}

TEST(PilotHealth, MissingStatesAreToldAlsoWhenNothingIsSentAnyMore) {
  Bench bench;
  hover(&bench, 50s, 200ms);
  bench.clock.advance(30ms);
  EXPECT_EQ(bench.step()->health.problems, bit(Problem::kStatesMissing));
  bench.clock.advance(2s);
  EXPECT_EQ(bench.step(), nullptr);
  EXPECT_EQ(bench.telemetry().health.problems, bit(Problem::kStatesMissing));
}

TEST(PilotHealth, RefusedStatesAndFramesAreTold) {
  Bench bench;
  hover(&bench, 50s, 200ms);
  auto bad = bench.state(50200ms);
  bad.state.v_WB.x() = std::nan("");
  bench.take(bad);
  auto frame = bench.frame(50200ms);
  frame.width_px = 31;
  bench.take(frame);
  EXPECT_EQ(bench.step()->health.problems, bit(Problem::kStatesRejected) | bit(Problem::kFramesRejected));
  EXPECT_EQ(hover(&bench, 50220ms, 1200ms), 0u);
}

TEST(PilotHealth, DepthThatIsMissingIsTold) {
  Bench bench;
  hover(&bench, 50s, 100ms);
  Problems told = 0;
  for (Stamp stamp = 50100ms; stamp < 50700ms; stamp += 20ms) {
    bench.take(bench.state(stamp, {1, 0, 1.5}));
    told = bench.step()->health.problems;
    bench.clock.advance(20ms);
  }
  EXPECT_EQ(told, bit(Problem::kDepthMissing));
}

TEST(PilotHealth, ADelayBeyondWhatIsMadeUpForIsTold) {
  Bench bench(protocol::Timing::kLockstep);
  EXPECT_EQ(hover(&bench, 50s, 1s, [](auto* state) { state->round_trip = 300ms; }), 0u);
  EXPECT_EQ(hover(&bench, 51s, 3s, [](auto* state) { state->round_trip = 700ms; }), bit(Problem::kDelayLong));
}

TEST(PilotHealth, LateStepsAreTold) {
  Bench bench;
  hover(&bench, 50s, 100ms);
  bench.pilot->stepping().missed_deadlines(2);
  EXPECT_EQ(hover(&bench, 50100ms, 20ms), bit(Problem::kDeadlinesMissed));
}

TEST(PilotHealth, WhatPerceptionFindsWrongIsToldWhenItLastsAndWhileItDoes) {
  const protocol::SessionRequest request = testing::join_request();
  Mailboxes shared;
  const auto script = std::make_shared<testing::FakePlanner::Script>();
  Stepping stepping(&request, 1, "any",
                    std::make_unique<testing::FakePlanner>(testing::small_profile(), request.quadrotor, script),
                    nullptr, &shared);
  Intake intake(&request, 1, &shared);
  shared.sensing_problems = bit(Problem::kDepthUnitLooksWrong);
  const auto told_at = [&](Stamp after, std::uint64_t sequence) {
    intake.take_state(testing::hover_state("drone", 1, sequence, 50s + after), 10s + after);
    return stepping.step(10s + after).command->health.problems & bit(Problem::kDepthUnitLooksWrong);
  };
  EXPECT_EQ(told_at(0s, 1), 0u);
  EXPECT_EQ(told_at(300ms, 2), bit(Problem::kDepthUnitLooksWrong));
  shared.sensing_problems = 0;
  EXPECT_EQ(told_at(1300ms, 3), 0u);
}

}  // namespace
}  // namespace gatefield::pilot
