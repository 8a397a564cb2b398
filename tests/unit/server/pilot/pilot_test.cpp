#include "server/pilot/pilot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "common/protocol/validate.h"
#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using testing::Bench;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

using Outcome = Intake::Outcome;

TEST(PilotRealTime, AnswersAStateWithAPlanThatAClientAccepts) {
  Bench bench;
  EXPECT_EQ(bench.step(), nullptr);  // nothing is known yet
  ASSERT_EQ(bench.take(bench.state(50s)), Outcome::kTaken);
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_TRUE(protocol::validate(*command).ok()) << protocol::validate(*command).error();
  EXPECT_EQ(command->vehicle, "drone");
  EXPECT_EQ(command->session, Bench::kId);
  EXPECT_EQ(command->sequence, 1u);
  EXPECT_EQ(command->answers_sequence, 1u);
  EXPECT_EQ(command->answers_stamp, 50s);
  EXPECT_EQ(command->plan_start, 50s);  // no delay was measured yet, and the state is fresh
  EXPECT_EQ(command->plan_step, 30ms);
  EXPECT_EQ(command->steps, 20);
  EXPECT_EQ(command->validity, 400ms);  // the plan is 600 ms long
  EXPECT_STREQ(command->isa.data(), "avx2");
  // What the thrust rates imply, at the end of each interval.
  const double hover_n = hover_thrust_n(bench.request.quadrotor)[0];
  EXPECT_NEAR(command->rotor_thrust_n[0][0], hover_n + 0.03, 1e-9);
  EXPECT_NEAR(command->rotor_thrust_n[19][2], hover_n + 0.6, 1e-9);
  EXPECT_NEAR(command->collective_thrust_n[19], 4 * (hover_n + 0.6), 1e-9);
  EXPECT_LT(command->body_rates_rad_s[19].norm(), 1e-9);
  EXPECT_EQ(command->health.latent_age_s, -1.0);
  EXPECT_EQ(command->health.effective_samples, 12.5);
  EXPECT_FALSE(command->health.degraded);
}

TEST(PilotRealTime, ShortPlansAreValidForTheirLength) {
  planner::Profile profile = testing::small_profile();
  profile.steps = 10;
  Bench bench(protocol::Timing::kRealTime, profile);
  bench.take(bench.state(50s));
  EXPECT_EQ(bench.step()->validity, 300ms);
}

TEST(PilotRealTime, PlansFromWhereTheVehicleWillBe) {
  Bench bench;
  // Round trip 30 ms, of which the server had the state for 10 ms: 20 ms of network. Solving takes 4 ms.
  bench.planner->during = [&] { bench.clock.advance(4ms); };
  bench.planner->rate_n_s = 12.0;
  Stamp stamp = 50s;
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 0; i < 100; ++i) {
    auto state = bench.state(stamp, {1.0, 0, 1.5});
    state.state.v_WB = {8, 0, 0};
    state.round_trip = 30ms;
    ASSERT_EQ(bench.take(state), Outcome::kTaken);
    bench.clock.advance(6ms);
    command = bench.step();
    ASSERT_NE(command, nullptr);
    stamp += 10ms;
  }
  const double ahead_s = seconds(command->plan_start - command->answers_stamp);
  EXPECT_NEAR(ahead_s, 0.006 + 0.020 + 0.004, 5e-4);
  EXPECT_NEAR(command->health.state_age_s, ahead_s, 1e-9);
  EXPECT_NEAR(command->health.solve_time_s, 0.004, 1e-9);
  const QuadrotorState& start = bench.planner->last.start;
  EXPECT_NEAR(start.p_WB.x(), 1.0 + 8.0 * ahead_s, 5e-3);
  // ... through the commands that were sent: the thrusts rise at 12 N/s meanwhile.
  const double hover_n = hover_thrust_n(bench.request.quadrotor)[0];
  EXPECT_NEAR(start.thrust_command_n[0], hover_n + 12.0 * ahead_s, 1e-6);
  EXPECT_NEAR(bench.planner->last.elapsed_s, 0.010, 1e-3);
}

TEST(PilotRealTime, AnAccelerationBeyondTheModelReachesThePlannerOnceTheDelayIsKnown) {
  Bench bench;
  const auto fly = [&](int from, int to, Stamp round_trip) {
    for (int i = from; i < to; ++i) {
      auto state = bench.state(50s + i * 20ms, {0, 0, 1.5});
      state.state.v_WB = {0.02 * (i - 190), 0, 0};  // 1 m/s^2 that no thrust explains; slow at the end, without drag
      state.round_trip = round_trip;
      bench.take(state);
      bench.step();
      bench.clock.advance(20ms);
    }
    return bench.planner->last.disturbance_W_m_s2.x();
  };
  EXPECT_EQ(fly(0, 50, 0ms), 0.0);
  EXPECT_NEAR(fly(50, 200, 10ms), 1.0, 0.3);
}

TEST(PilotRealTime, GoesOnFromItsPredictionAndSaysSo) {
  Bench bench;
  auto state = bench.state(50s, {0, 0, 1.5});
  state.state.v_WB = {2, 0, 0};
  bench.take(state);
  ASSERT_NE(bench.step(), nullptr);
  EXPECT_EQ(bench.planner->last.start.p_WB.x(), 0.0);

  bench.clock.advance(10ms);
  ASSERT_NE(bench.step(), nullptr);
  bench.clock.advance(90ms);
  const auto* const late = bench.step();
  ASSERT_NE(late, nullptr);
  EXPECT_TRUE(late->health.degraded);
  EXPECT_NEAR(late->health.state_age_s, 0.1, 1e-9);
  EXPECT_EQ(late->answers_sequence, 1u);
  EXPECT_EQ(late->plan_start, 50s + 100ms);
  EXPECT_EQ(late->sequence, 3u);
  EXPECT_NEAR(bench.planner->last.start.p_WB.x(), 0.2, 0.01);
}

TEST(PilotRealTime, FallsSilentWithoutStatesAndReturnsWithThem) {
  Bench bench;
  bench.take(bench.state(50s));
  ASSERT_NE(bench.step(), nullptr);
  bench.clock.advance(500ms);
  EXPECT_NE(bench.step(), nullptr);
  bench.clock.advance(1ms);
  EXPECT_EQ(bench.step(), nullptr);
  bench.clock.advance(5s);
  EXPECT_EQ(bench.step(), nullptr);
  bench.take(bench.state(55501ms));
  const auto* const again = bench.step();
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->answers_sequence, 2u);
  EXPECT_EQ(again->health.state_age_s, 0.0);
}

TEST(PilotRealTime, ACommandThatTheTransportDidNotTakeIsTold) {
  Bench bench;
  bench.take(bench.state(50s));
  ASSERT_NE(bench.pilot->stepping().step(bench.clock.now()).command, nullptr);
  bench.pilot->stepping().sent(bench.clock.now(), false);
  EXPECT_EQ(bench.telemetry().commands_sent, 0u);
  EXPECT_THAT(bench.pilot->complaints().value_or(""), HasSubstr("1 times the transport took no command"));
  EXPECT_FALSE(bench.pilot->complaints().has_value());
}

TEST(PilotInput, ABadStateIsCountedAndLeftOut) {
  Bench bench;
  bench.take(bench.state(50s));
  ASSERT_NE(bench.step(), nullptr);

  auto bad = bench.state(50010ms);
  bad.state.v_WB.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(bench.take(bad), Outcome::kRejected);
  auto skewed = bench.state(50010ms);
  skewed.state.q_WB.coeffs() *= 1.1;
  EXPECT_EQ(bench.take(skewed), Outcome::kRejected);

  bench.clock.advance(10ms);
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->answers_sequence, 1u);
  EXPECT_TRUE(command->health.degraded);
  const auto telemetry = bench.telemetry();
  EXPECT_EQ(telemetry.states_received, 3u);
  EXPECT_EQ(telemetry.states_rejected, 2u);
  EXPECT_THAT(telemetry.last_reason, HasSubstr("q_WB"));
  EXPECT_TRUE(protocol::validate(telemetry).ok()) << protocol::validate(telemetry).error();
  EXPECT_THAT(bench.pilot->complaints().value_or(""), HasSubstr("2 complaints"));
  EXPECT_FALSE(bench.pilot->complaints().has_value());

  bench.take(bench.state(50020ms));
  EXPECT_FALSE(bench.step()->health.degraded);
}

TEST(PilotInput, TimeDoesNotGoBackwards) {
  Bench bench;
  bench.take(bench.state(50s));
  EXPECT_EQ(bench.take(bench.state(50s)), Outcome::kRejected);
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("stamp jumped from 50000000000 ns to 50000000000 ns"));
  EXPECT_EQ(bench.pilot->last_note()->code, ErrorCode::kNotRising);
  EXPECT_EQ(bench.pilot->last_note()->field, "stamp");
  EXPECT_EQ(bench.take(bench.state(49s)), Outcome::kRejected);
  auto repeated = bench.state(51s);
  repeated.sequence = 1;
  EXPECT_EQ(bench.take(repeated), Outcome::kRejected);
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("sequence jumped from 1 to 1"));
  EXPECT_EQ(bench.take(bench.state(51s)), Outcome::kTaken);
}

TEST(PilotInput, AnotherSessionsSamplesAreDropped) {
  Bench bench;
  auto stale = bench.state(50s);
  stale.session = 99;
  EXPECT_EQ(bench.take(stale), Outcome::kRejected);
  auto frame = bench.frame(50s);
  frame.session = 99;
  EXPECT_EQ(bench.take(frame), Outcome::kRejected);
  EXPECT_EQ(bench.pilot->last_note()->code, ErrorCode::kWrongSession);
  EXPECT_EQ(bench.telemetry().states_rejected, 1u);
  EXPECT_EQ(bench.telemetry().frames_rejected, 1u);
  EXPECT_EQ(bench.step(), nullptr);
}

TEST(PilotDepth, AFrameOfTheWrongSizeIsRejected) {
  Bench bench;
  bench.take(bench.state(50s));
  auto frame = bench.frame(50s);
  frame.width_px = 31;
  EXPECT_EQ(bench.take(frame), Outcome::kRejected);
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("31 x 18 px"));
  auto cut = bench.frame(50s);
  cut.pixels.pop_back();
  EXPECT_EQ(bench.take(cut), Outcome::kRejected);
  EXPECT_FALSE(bench.pilot->looking().due());
  EXPECT_EQ(bench.telemetry().frames_rejected, 2u);
}

TEST(PilotDepth, WhatAFrameShowsReachesThePlanner) {
  Bench bench;
  bench.sensor->center_C = Eigen::Vector3d(0, 0, 4);
  bench.take(bench.state(50s, {1, 0, 1.5}));
  auto frame = bench.frame(50s);
  EXPECT_EQ(bench.take(frame), Outcome::kTaken);
  ASSERT_TRUE(bench.pilot->looking().due());
  EXPECT_TRUE(bench.look());
  EXPECT_FALSE(bench.look());  // once per frame
  bench.clock.advance(20ms);
  bench.take(bench.state(50020ms, {1, 0, 1.5}));
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  const planner::PlanInput& input = bench.planner->last;
  EXPECT_TRUE(input.target.seen);
  const Eigen::Vector3d expected_W = Eigen::Vector3d(1, 0, 1.5) + bench.request.camera.X_BC * Eigen::Vector3d(0, 0, 4);
  EXPECT_LT((input.target.center_W - expected_W).norm(), 1e-6);
  EXPECT_NEAR(input.field_age_s, 0.020, 1e-9);
  EXPECT_NEAR(command->health.latent_age_s, 0.020, 1e-9);
  EXPECT_TRUE(input.has_next);
}

TEST(PilotDepth, AProfileMayKeepTheNominalWaypointBesideTheField) {
  planner::Profile profile = testing::small_profile();
  profile.waypoint_from_field = false;
  Bench bench(protocol::Timing::kRealTime, profile);
  bench.sensor->center_C = Eigen::Vector3d(0, 0, 4);
  bench.take(bench.state(50s, {1, 0, 1.5}));
  auto frame = bench.frame(50s);
  bench.take(frame);
  bench.look();
  ASSERT_NE(bench.step(), nullptr);
  const planner::PlanInput& input = bench.planner->last;
  EXPECT_TRUE(input.target.seen);
  EXPECT_NE(input.target.field, nullptr);
  EXPECT_EQ(input.target.center_W, bench.request.course.waypoints[0].p_W);
  const Eigen::Vector3d believed_W = Eigen::Vector3d(1, 0, 1.5) + bench.request.camera.X_BC * Eigen::Vector3d(0, 0, 4);
  EXPECT_LT((bench.observer->target.center_W - believed_W).norm(), 1e-6);
  EXPECT_EQ(bench.observer->stamp, 50s);
  EXPECT_EQ(bench.observer->waypoint, 0u);
}

TEST(PilotDepth, EmptyAndSaturatedFramesLeaveTheLastLatentWithItsAge) {
  Bench bench;
  bench.take(bench.state(50s));
  auto good = bench.frame(50s);
  bench.take(good);
  bench.look();
  Stamp stamp = 50s;
  for (const std::uint16_t mm : {std::uint16_t{0}, std::uint16_t{65535}}) {
    stamp += 300ms;
    bench.clock.advance(300ms);
    bench.take(bench.state(stamp));
    auto frame = bench.frame(stamp, mm);
    EXPECT_EQ(bench.take(frame), Outcome::kTaken);
    EXPECT_TRUE(bench.look());
  }
  const auto* const command = bench.step();
  EXPECT_NEAR(command->health.latent_age_s, 0.6, 1e-9);
  EXPECT_TRUE(command->health.degraded);  // nothing usable for more than half a second
  EXPECT_TRUE(bench.planner->last.target.seen);
  EXPECT_EQ(bench.telemetry().frames_invalid, 2u);
  EXPECT_EQ(bench.telemetry().frames_rejected, 0u);
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("saturated"));
}

TEST(PilotDepth, NothingIsSaidOfFramesFromJustBeforeTheFirstState) {
  Bench bench;
  auto first = bench.frame(49900ms);
  bench.take(first);
  bench.look();
  bench.take(bench.state(50s));
  auto second = bench.frame(49950ms);
  bench.take(second);
  bench.look();
  EXPECT_EQ(bench.telemetry().frames_rejected, 2u);
  EXPECT_FALSE(bench.pilot->last_note());
  EXPECT_EQ(bench.telemetry().last_reason, "");
}

TEST(PilotDepth, AFrameWithoutAPoseIsDroppedWithItsReason) {
  Bench bench;
  auto first = bench.frame(48s);
  bench.take(first);
  bench.look();
  auto early = bench.frame(49s);
  bench.take(early);
  bench.look();
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("has no pose: no state came yet"));
  EXPECT_EQ(bench.pilot->last_note()->code, ErrorCode::kFrame);

  bench.take(bench.state(50s));
  auto old = bench.frame(49500ms);
  bench.take(old);
  bench.look();
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("before the oldest state"));

  auto future = bench.frame(50060ms);
  bench.take(future);
  bench.look();
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("after the newest state"));
  EXPECT_EQ(bench.telemetry().frames_rejected, 4u);
  EXPECT_EQ(bench.sensor->calls, 0);
}

TEST(PilotDepth, AnEncoderThatThrowsCostsOneFrame) {
  Bench bench;
  bench.take(bench.state(50s));
  bench.sensor->throws = true;
  auto frame = bench.frame(50s);
  bench.take(frame);
  EXPECT_TRUE(bench.look());
  EXPECT_EQ(bench.telemetry().frames_rejected, 1u);
  EXPECT_THAT(bench.telemetry().last_reason, HasSubstr("the server's sensor failed: tensor of the wrong size"));
  EXPECT_EQ(bench.telemetry().last_code, ErrorCode::kUnsupported) << "nothing was wrong with the frame";
  EXPECT_NE(bench.step(), nullptr);
}

TEST(PilotLockstep, AnswersEachStateOnceAndRepeatsWhenAsked) {
  Bench bench(protocol::Timing::kLockstep);
  const auto first = bench.state(50s);
  bench.take(first);
  const auto* command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->plan_start, 50s);  // no delay was measured
  EXPECT_EQ(command->sequence, 1u);
  EXPECT_EQ(bench.step(), nullptr);

  EXPECT_EQ(bench.take(first), Outcome::kRepeated);
  command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->sequence, 1u);
  EXPECT_EQ(bench.planner->plans, 1u);
  EXPECT_EQ(bench.step(), nullptr);
  EXPECT_EQ(bench.telemetry().states_rejected, 0u);

  // A long pause of the simulator is no age.
  bench.clock.advance(30s);
  bench.take(bench.state(50010ms));
  command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->plan_start, 50010ms);
  EXPECT_EQ(command->health.state_age_s, 0.0);
  EXPECT_FALSE(command->health.degraded);
}

TEST(PilotLockstep, PlansFromWhereTheVehicleWillBeAfterTheMeasuredDelay) {
  Bench bench(protocol::Timing::kLockstep);
  bench.planner->rate_n_s = 12.0;
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 0; i < 100; ++i) {
    auto state = bench.state(50s + i * 20ms, {1.0, 0, 1.5});
    state.state.v_WB = {8, 0, 0};
    state.round_trip = 100ms;
    bench.take(state);
    bench.clock.advance(i % 3 * 7ms);  // the machine's own time says nothing
    command = bench.step();
    ASSERT_NE(command, nullptr);
  }
  EXPECT_NEAR(seconds(command->plan_start - command->answers_stamp), 0.100, 1e-4);
  const QuadrotorState& start = bench.planner->last.start;
  EXPECT_NEAR(start.p_WB.x(), 1.8, 0.02);
  // ... through the commands that were sent: the thrusts rise at 12 N/s meanwhile.
  EXPECT_NEAR(start.thrust_command_n[0], hover_thrust_n(bench.request.quadrotor)[0] + 1.2, 0.01);
}

TEST(PilotLockstep, AProfileMayLeaveTheDelayUnpredicted) {
  planner::Profile profile = testing::small_profile();
  profile.predict_delay = false;
  Bench bench(protocol::Timing::kLockstep, profile);
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 0; i < 10; ++i) {
    auto state = bench.state(50s + i * 20ms, {1.0, 0, 1.5});
    state.state.v_WB = {8, 0, 0};
    state.round_trip = 100ms;
    bench.take(state);
    command = bench.step();
    ASSERT_NE(command, nullptr);
  }
  EXPECT_EQ(command->plan_start, command->answers_stamp);
  EXPECT_EQ(bench.planner->last.start.p_WB.x(), 1.0);
}

TEST(PilotLockstep, WaitsForTheFrameThatTheStateNames) {
  Bench bench(protocol::Timing::kLockstep);
  auto frame = bench.frame(50s);
  auto state = bench.state(50s);
  state.depth_sequence = 1;
  bench.take(state);
  EXPECT_EQ(bench.step(), nullptr);
  EXPECT_EQ(bench.wake_at, bench.clock.now() + Stepping::kDepthWait);
  EXPECT_FALSE(bench.pilot->looking().due());
  bench.take(frame);
  ASSERT_TRUE(bench.pilot->looking().due());
  bench.look();
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_TRUE(bench.planner->last.target.seen);
  EXPECT_EQ(command->health.latent_age_s, 0.0);
  EXPECT_FALSE(command->health.degraded);
}

TEST(PilotLockstep, AFrameIsNotTouchedBeforeAStateNamesIt) {
  // Its pose is that state's; and two frames before a state must give the same as one.
  Bench bench(protocol::Timing::kLockstep);
  auto first = bench.frame(50s);
  auto second = bench.frame(50005ms);
  bench.take(first);
  EXPECT_FALSE(bench.pilot->looking().due());
  auto state = bench.state(50010ms);
  state.depth_sequence = 2;
  bench.take(bench.state(50s));
  state.sequence = 3;
  bench.take(state);
  EXPECT_FALSE(bench.pilot->looking().due());  // frame 1 is here, but frame 2 is what counts
  bench.take(second);
  EXPECT_TRUE(bench.pilot->looking().due());
}

TEST(PilotLockstep, DoesNotWaitForeverForAFrame) {
  Bench bench(protocol::Timing::kLockstep);
  auto state = bench.state(50s);
  state.depth_sequence = 1;
  bench.take(state);
  EXPECT_EQ(bench.step(), nullptr);
  bench.clock.advance(Stepping::kDepthWait - 1ms);
  EXPECT_EQ(bench.step(), nullptr);
  bench.clock.advance(1ms);
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_TRUE(command->health.degraded);
}

TEST(PilotLockstep, DoesNotWaitForAFrameThatWasRefused) {
  Bench bench(protocol::Timing::kLockstep);
  auto frame = bench.frame(50s);
  frame.width_px = 31;
  EXPECT_EQ(bench.take(frame), Outcome::kRejected);
  auto state = bench.state(50s);
  state.depth_sequence = 1;
  bench.take(state);
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_TRUE(command->health.degraded);
}

TEST(PilotLockstep, AFrameThatComesAgainChangesNothing) {
  Bench bench(protocol::Timing::kLockstep);
  auto frame = bench.frame(50s);
  auto again = frame;
  bench.take(frame);
  EXPECT_EQ(bench.take(again), Outcome::kRepeated);
  EXPECT_EQ(bench.telemetry().frames_rejected, 0u);
  auto state = bench.state(50s);
  state.depth_sequence = 1;
  bench.take(state);
  EXPECT_EQ(bench.step(), nullptr);  // still waits for the first one to be processed
  bench.look();
  EXPECT_NE(bench.step(), nullptr);
}

TEST(PilotLockstep, SameInputsSameCommands) {
  const auto fly = [] {
    Bench bench(protocol::Timing::kLockstep);
    std::vector<protocol::ThrustRateCommand> commands;
    for (int i = 0; i < 60; ++i) {
      const Stamp stamp = 50s + i * 20ms;
      auto frame = bench.frame(stamp);
      bench.take(frame);
      auto state = bench.state(stamp, {0.2 * i, 0, 1.5});
      state.depth_sequence = bench.frame_sequence;
      state.thrust_known = false;
      bench.take(state);
      bench.look();
      commands.push_back(*bench.step());
    }
    return commands;
  };
  const auto a = fly();
  const auto b = fly();
  ASSERT_EQ(a.size(), 60u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].plan_start, b[i].plan_start);
    EXPECT_EQ(a[i].health.target_waypoint, b[i].health.target_waypoint);
    for (std::size_t k = 0; k < 20; ++k) {
      EXPECT_EQ(a[i].thrust_rate_n_s[k], b[i].thrust_rate_n_s[k]);
      EXPECT_EQ(a[i].rotor_thrust_n[k], b[i].rotor_thrust_n[k]);
    }
  }
  EXPECT_GE(a.back().health.target_waypoint, 2u);  // it flew past two gates
}

TEST(PilotRotors, AreModelledWhenTheVehicleCantTell) {
  Bench bench(protocol::Timing::kLockstep);
  bench.planner->rate_n_s = 10.0;
  QuadrotorState rotors;
  rotors.thrust_n = rotors.thrust_command_n = hover_thrust_n(bench.request.quadrotor);
  for (int i = 0; i < 5; ++i) {
    auto state = bench.state(50s + i * 20ms);
    state.thrust_known = false;
    state.state.thrust_n.setZero();
    state.state.thrust_command_n.setZero();
    bench.take(state);
    ASSERT_NE(bench.step(), nullptr);
    EXPECT_LT((bench.planner->last.start.thrust_n - rotors.thrust_n).norm(), 1e-9);
    EXPECT_LT((bench.planner->last.start.thrust_command_n - rotors.thrust_command_n).norm(), 1e-9);
    step_rotors(bench.request.quadrotor, ThrustRates::Constant(10.0), 0.02, &rotors);
  }
}

/// Moves in a straight line to x, a state every 100 ms and 0.8 m at most; backwards through a gate counts nothing.
/// @return the answer to the last state
const protocol::ThrustRateCommand* fly_along(Bench* bench, Stamp* stamp, double from_x, double x) {
  const protocol::ThrustRateCommand* command = nullptr;
  const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(x - from_x) / 0.8)));
  for (int i = 1; i <= steps; ++i) {
    auto state = bench->state(*stamp += 100ms, {from_x + (x - from_x) * i / steps, 0, 1.5});
    state.state.v_WB = {8, 0, 0};
    bench->take(state);
    command = bench->step();
  }
  return command;
}

TEST(PilotProgress, CountsGatesAndHoldsBehindTheLastOne) {
  Bench bench(protocol::Timing::kLockstep);
  Stamp stamp = 50s;
  double at_x = 4.9;
  const auto fly_to = [&](double x) { return fly_along(&bench, &stamp, std::exchange(at_x, x), x); };
  fly_to(4.9);
  EXPECT_EQ(bench.planner->last.target.center_W.x(), 5.0);
  EXPECT_EQ(bench.planner->last.next.center_W.x(), 11.0);
  EXPECT_FALSE(bench.planner->last.has_passed_gate);
  EXPECT_EQ(fly_to(5.1)->health.target_waypoint, 1u);
  EXPECT_TRUE(bench.planner->last.has_passed_gate);  // its frame is still there
  EXPECT_EQ(bench.planner->last.passed_gate.center_W.x(), 5.0);
  EXPECT_EQ(bench.planner->last.target.center_W.x(), 11.0);
  for (int lap = 0; lap < 2; ++lap)
    for (int gate = lap == 0 ? 1 : 0; gate < 4; ++gate) {
      fly_to(5.0 + 6.0 * gate - 0.1);
      fly_to(5.0 + 6.0 * gate + 0.1);
    }
  const auto* const command = fly_to(23.3);
  EXPECT_TRUE(command->health.course_done);
  EXPECT_EQ(command->health.lap, 1u);
  EXPECT_TRUE(bench.planner->last.hold);
  EXPECT_NEAR(bench.planner->last.target.center_W.x(), 27.0, 0.1);  // 8 m/s brakes within 4 m
}

TEST(PilotProgress, APlanThatStartsBehindTheGateIsForTheNextOne) {
  Bench bench;
  for (int i = 0; i < 50; ++i) {
    auto state = bench.state(50s + i * 10ms, {4.0, 0, 1.5});
    state.round_trip = 40ms;
    bench.take(state);
    bench.step();
    bench.clock.advance(10ms);
  }
  auto state = bench.state(50600ms, {4.8, 0, 1.5});
  state.state.v_WB = {10, 0, 0};
  state.round_trip = 40ms;
  bench.take(state);
  const auto* const command = bench.step();
  EXPECT_NEAR(bench.planner->last.start.p_WB.x(), 5.2, 0.02);
  EXPECT_EQ(bench.planner->last.target.center_W.x(), 11.0);
  EXPECT_EQ(bench.planner->last.passed_gate.center_W.x(), 5.0);
  EXPECT_EQ(command->health.target_waypoint, 0u);  // measured, it has not passed yet
}

TEST(PilotProgress, GoesOnWhereAnEarlierServerWas) {
  Bench bench;
  auto state = bench.state(50s, {9, 0, 1.5});
  state.heard_waypoint = 1;
  state.heard_lap = 1;
  bench.take(state);
  auto frame = bench.frame(50s);
  bench.take(frame);
  bench.look();  // before the first plan: looks for gate 1 already
  EXPECT_TRUE(bench.saw(1));
  EXPECT_FALSE(bench.saw(0));
  const auto* const command = bench.step();
  EXPECT_EQ(command->health.target_waypoint, 1u);
  EXPECT_EQ(command->health.lap, 1u);
  EXPECT_TRUE(bench.planner->last.target.seen);
}

TEST(PilotProgress, AFalseFirstStateOfAResumedSessionCountsNoGate) {
  Bench bench;
  auto lapse = bench.state(50s, {12.5, 0, 1.5});  // behind gate 1, which the vehicle has yet to pass
  lapse.heard_waypoint = 1;
  bench.take(lapse);
  EXPECT_EQ(bench.step()->health.target_waypoint, 1u);
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 1; i < 10; ++i) {
    bench.clock.advance(10ms);
    auto state = bench.state(50s + i * 10ms, {9, 0, 1.5});
    state.heard_waypoint = 1;
    bench.take(state);
    command = bench.step();
  }
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(bench.planner->last.start.p_WB.x(), 9.0);
  EXPECT_EQ(command->health.target_waypoint, 1u);
}

TEST(PilotProgress, AGateThatWasPassedWithoutAServerCountsOnceTwoStatesSaySo) {
  Bench bench;
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 0; i < 2; ++i) {
    auto state = bench.state(50s + i * 10ms, {12.5, 0, 1.5});
    state.heard_waypoint = 1;
    bench.take(state);
    command = bench.step();
    ASSERT_NE(command, nullptr);
    EXPECT_EQ(command->health.target_waypoint, i == 0 ? 1u : 2u);
    bench.clock.advance(10ms);
  }
}

TEST(PilotGuard, ACommandThatIsNotFiniteOrBeyondLimitsIsNeverSent) {
  Bench bench;
  bench.take(bench.state(50s));
  bench.planner->not_finite = true;
  EXPECT_EQ(bench.step(), nullptr);
  EXPECT_EQ(bench.planner->resets, 1);
  EXPECT_THAT(bench.pilot->complaints().value_or(""), HasSubstr("not finite"));

  bench.planner->not_finite = false;
  bench.planner->rate_n_s = 30.1;  // the vehicle can 30
  EXPECT_EQ(bench.step(), nullptr);
  EXPECT_THAT(bench.pilot->complaints().value_or(""), HasSubstr("thrust rate"));
  EXPECT_EQ(bench.telemetry().commands_sent, 0u);

  bench.planner->rate_n_s = -30.0;
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->sequence, 1u);
}

TEST(PilotGuard, AFailedPlanIsFlownButCalledDegraded) {
  Bench bench;
  bench.take(bench.state(50s));
  bench.planner->ok = false;
  const auto* const command = bench.step();
  ASSERT_NE(command, nullptr);
  EXPECT_TRUE(command->health.degraded);
}

TEST(PilotGuard, ACommandedThrustBeyondTheLimitsIsTakenAsTheLimit) {
  Bench bench;
  auto state = bench.state(50s);
  state.state.thrust_command_n.setConstant(12.0);  // the rotors can 10
  bench.take(state);
  bench.planner->rate_n_s = -5.0;
  ASSERT_NE(bench.step(), nullptr);
  EXPECT_EQ(bench.planner->last.start.thrust_command_n[0], 10.0);
}

TEST(PilotSave, AFrameThatWaitsIsTakenWhenItComesAgain) {
  Bench stays(protocol::Timing::kLockstep), moved(protocol::Timing::kLockstep);
  auto frame = stays.frame(50s);
  auto again = frame;
  auto state = stays.state(50s);
  state.depth_sequence = 1;
  stays.take(frame);
  stays.take(state);
  EXPECT_EQ(stays.step(), nullptr);  // waits for the frame to be looked at
  ASSERT_TRUE(moved.pilot->restore(stays.pilot->save()).ok());
  EXPECT_FALSE(moved.pilot->looking().due());
  EXPECT_EQ(moved.step(), nullptr);
  EXPECT_EQ(moved.take(again), Outcome::kTaken);
  ASSERT_TRUE(moved.look());
  const auto* const command = moved.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->answers_sequence, 1u);
  EXPECT_FALSE(command->health.degraded);
}

TEST(PilotSave, AStateThatComesAgainGetsTheSameAnswerElsewhere) {
  Bench stays(protocol::Timing::kLockstep), moved(protocol::Timing::kLockstep);
  const auto state = stays.state(50s);
  stays.take(state);
  const protocol::ThrustRateCommand answer = *stays.step();
  ASSERT_TRUE(moved.pilot->restore(stays.pilot->save()).ok());
  EXPECT_EQ(moved.step(), nullptr);
  EXPECT_EQ(moved.take(state), Outcome::kRepeated);
  const auto* const again = moved.step();
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->sequence, answer.sequence);
  EXPECT_EQ(again->plan_start, answer.plan_start);
  EXPECT_EQ(again->rotor_thrust_n[19], answer.rotor_thrust_n[19]);
  EXPECT_EQ(moved.planner->plans, 0u);
}

TEST(PilotSave, WhereToHoldBehindTheLastGateMovesAlong) {
  Bench stays(protocol::Timing::kLockstep), moved(protocol::Timing::kLockstep);
  Stamp stamp = 50s;
  double at_x = 4.9;
  for (int lap = 0; lap < 2; ++lap)
    for (int gate = 0; gate < 4; ++gate)
      for (const double x : {5.0 + 6.0 * gate - 0.1, 5.0 + 6.0 * gate + 0.1})
        fly_along(&stays, &stamp, std::exchange(at_x, x), x);
  ASSERT_TRUE(stays.planner->last.hold);
  ASSERT_TRUE(moved.pilot->restore(stays.pilot->save()).ok());
  auto state = stays.state(stamp + 20ms, {24, 0, 1.5});
  state.state.v_WB = {2, 0, 0};  // would brake nearer to the gate, were it to begin now
  moved.take(state);
  EXPECT_TRUE(moved.step()->health.course_done);
  EXPECT_EQ(moved.planner->last.target.center_W, stays.planner->last.target.center_W);
  EXPECT_EQ(moved.planner->last.passed_gate.center_W.x(), 23.0);
  EXPECT_TRUE(moved.planner->last.has_passed_gate);
}

}  // namespace
}  // namespace gatefield::pilot
