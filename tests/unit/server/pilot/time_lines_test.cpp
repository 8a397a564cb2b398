// Clocks that begin anew, counts that do, vehicles that do elsewhere, and single samples far off: what a pilot makes of
// them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "common/protocol/validate.h"
#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using testing::Bench;
using ::testing::HasSubstr;
using namespace std::chrono_literals;

using Outcome = Intake::Outcome;
using protocol::Problem;

constexpr std::uint64_t kHugeSequence = std::numeric_limits<std::uint64_t>::max();
constexpr Stamp kHugeStamp = Stamp::max();
constexpr Stamp kPeriod = 20ms;
constexpr Stamp kMayCost = 200ms;

class TimeLines : public ::testing::TestWithParam<protocol::Timing> {
 protected:
  bool lockstep() const { return GetParam() == protocol::Timing::kLockstep; }

  /// A frame and a state at `stamp`, looked at and stepped, all as a client of this timing does it: in lockstep it asks
  /// again until it is answered. Counts for how long there was no plan for now.
  void fly(Stamp stamp) {
    auto frame = bench_.frame(stamp);
    bench_.take(frame);
    auto state = bench_.state(stamp, {0.02 * static_cast<double>(bench_.state_sequence), 0, 1.5});
    state.state.v_WB.x() = 1.0;
    state.depth_sequence = bench_.frame_sequence;
    const protocol::ThrustRateCommand* command = nullptr;
    for (int attempt = 0; attempt < (lockstep() ? 5 : 1); ++attempt) {
      bench_.take(state);
      if (bench_.pilot->looking().due()) bench_.look();
      if ((command = bench_.step())) break;
    }
    bench_.clock.advance(kPeriod);
    if (command) {
      const Status status = protocol::validate(*command);
      EXPECT_TRUE(status.ok()) << status.error();
    }
    const bool planned = command && command->answers_stamp <= stamp && stamp - command->plan_start < kMayCost;
    without_ = planned ? Stamp{0} : without_ + kPeriod;
    longest_without_ = std::max(longest_without_, without_);
    if (command) newest_ = *command;
  }
  void fly(Stamp from, int steps) {
    for (int i = 0; i < steps; ++i) fly(from + i * kPeriod);
  }
  bool told(Problem problem) const { return (newest_.health.problems & protocol::bit(problem)) != 0; }

  Bench bench_{GetParam()};
  protocol::ThrustRateCommand newest_;
  Stamp without_{0}, longest_without_{0};
};

TEST_P(TimeLines, OneStateFarOffCostsLittleWhereverItComes) {
  struct Bad {
    std::uint64_t sequence;
    Stamp stamp;
  };
  for (const Bad& bad : {Bad{0, kHugeStamp}, Bad{0, TimeLine::kMaxStamp}, Bad{0, 9000s}, Bad{kHugeSequence, 50s},
                         Bad{kHugeSequence, kHugeStamp}, Bad{kHugeSequence, TimeLine::kMaxStamp}}) {
    for (const int at : {0, 1, 30}) {
      SCOPED_TRACE(std::to_string(bad.sequence) + " at " + std::to_string(bad.stamp.count()) + " after " +
                   std::to_string(at) + " states");
      bench_ = Bench(GetParam());
      longest_without_ = without_ = Stamp{0};
      fly(50s, at);
      auto state = bench_.state(bad.stamp);
      if (bad.sequence != 0) state.sequence = bad.sequence;
      bench_.take(state);
      bench_.step();
      fly(50s + at * kPeriod, 60);
      EXPECT_LE(longest_without_, kMayCost);
      EXPECT_EQ(without_, Stamp{0});
      EXPECT_FALSE(newest_.health.degraded);
      EXPECT_TRUE(bench_.saw(0));
      EXPECT_NEAR(newest_.health.latent_age_s, 0.0, 1e-9);
    }
  }
}

TEST_P(TimeLines, OneFrameFarOffCostsLittleWhereverItComes) {
  struct Bad {
    std::uint64_t sequence;
    Stamp stamp;
  };
  for (const Bad& bad : {Bad{0, kHugeStamp}, Bad{0, TimeLine::kMaxStamp}, Bad{kHugeSequence, 50s},
                         Bad{kHugeSequence, kHugeStamp}, Bad{kHugeSequence, TimeLine::kMaxStamp}}) {
    for (const int at : {0, 1, 30}) {
      SCOPED_TRACE(std::to_string(bad.sequence) + " at " + std::to_string(bad.stamp.count()) + " after " +
                   std::to_string(at) + " frames");
      bench_ = Bench(GetParam());
      longest_without_ = without_ = Stamp{0};
      fly(50s, at);
      auto frame = bench_.frame(bad.stamp);
      if (bad.sequence != 0) {
        frame.sequence = bad.sequence;
        --bench_.frame_sequence;
      }
      bench_.take(frame);
      fly(50s + at * kPeriod, 10);
      EXPECT_LE(longest_without_, kMayCost);
      EXPECT_TRUE(bench_.saw(0));
      EXPECT_NEAR(newest_.health.latent_age_s, 0.0, 1e-9) << "frames are looked at again";
      fly(50s + (at + 10) * kPeriod, 60);
      EXPECT_FALSE(newest_.health.degraded);
      EXPECT_EQ(newest_.health.problems, 0u);
    }
  }
}

TEST_P(TimeLines, AClockBackAtZeroInMidSessionFliesOn) {
  fly(500s, 300);  // through the first gate
  ASSERT_EQ(newest_.health.target_waypoint, 1u);
  ASSERT_TRUE(bench_.saw(1));
  const int resets = bench_.planner->resets;
  fly(0s, 10);
  EXPECT_LE(longest_without_, kMayCost);
  EXPECT_EQ(without_, Stamp{0});
  EXPECT_TRUE(told(Problem::kStampsJump));
  EXPECT_EQ(newest_.health.target_waypoint, 1u) << "progress stays";
  EXPECT_TRUE(bench_.planner->last.target.seen) << "so do the gates";
  EXPECT_EQ(bench_.planner->resets, resets) << "and the warm start";
  EXPECT_EQ(newest_.answers_stamp, 9 * kPeriod);
  EXPECT_NEAR(newest_.health.latent_age_s, 0.0, 1e-9) << "frames are bound to the new states";
  fly(10 * kPeriod, 100);
  EXPECT_EQ(newest_.health.problems, 0u);
  EXPECT_FALSE(newest_.health.degraded);
  EXPECT_EQ(bench_.telemetry().states_received, 300u + 110u + (lockstep() ? 2u : 0u));
}

TEST_P(TimeLines, AClockThatLeapsAYearAheadFliesOn) {
  fly(50s, 300);
  fly(30'000'000s, 10);
  EXPECT_LE(longest_without_, kMayCost);
  EXPECT_EQ(without_, Stamp{0});
  EXPECT_EQ(newest_.health.target_waypoint, 1u);
  fly(30'000'000s + 10 * kPeriod, 100);
  EXPECT_EQ(newest_.health.problems, 0u);
  EXPECT_FALSE(newest_.health.degraded);
}

TEST_P(TimeLines, WhatWasSentAndMeasuredOnTheOldLineIsForgotten) {
  for (int i = 0; i < 50; ++i) {
    auto state = bench_.state(500s + i * kPeriod);
    state.round_trip = 100ms;
    state.thrust_known = false;
    bench_.take(state);
    bench_.step();
    bench_.clock.advance(kPeriod);
  }
  ASSERT_GT(bench_.planner->last.elapsed_s, 0.0);
  const double thrust_n = bench_.pilot->stepping().state().rotors.thrust_n[0];
  ASSERT_GT(thrust_n, hover_thrust_n(bench_.request.quadrotor)[0]);
  const protocol::ThrustRateCommand* command = nullptr;
  for (int i = 0; i < TimeLine::kAgree; ++i) {
    auto state = bench_.state(i * kPeriod);
    state.thrust_known = false;
    bench_.take(state);
    command = bench_.step();
    if (i + 1 < TimeLine::kAgree) bench_.clock.advance(kPeriod);
  }
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->plan_start, command->answers_stamp) << "the delay is not known any more";
  EXPECT_EQ(bench_.planner->last.elapsed_s, 0.0);
  EXPECT_EQ(bench_.pilot->stepping().state().rotors.thrust_n[0], thrust_n) << "the rotors are where they were";
}

TEST_P(TimeLines, FramesOfTheOldLineAreDropped) {
  fly(500s, 20);
  fly(0s, 5);
  const auto rejected = bench_.telemetry().frames_rejected;
  auto old = bench_.frame(500s + 20 * kPeriod);
  if (bench_.take(old) == Outcome::kTaken) bench_.look();  // a simulator may leap ahead; then it has no pose
  EXPECT_EQ(bench_.telemetry().frames_rejected, rejected + 1);
}

TEST_P(TimeLines, ALateStateIsLeftOutAndNothingElse) {
  fly(50s, 10);
  auto late = bench_.state(50s + 5 * kPeriod);
  late.sequence = 6;
  --bench_.state_sequence;
  EXPECT_EQ(bench_.take(late), Outcome::kRejected);
  const auto note = bench_.pilot->last_note();
  EXPECT_EQ(note->code, ErrorCode::kNotRising);
  EXPECT_EQ(note->field, "sequence");
  fly(50s + 10 * kPeriod);
  EXPECT_FALSE(newest_.health.degraded);
  EXPECT_EQ(newest_.health.problems, 0u);
}

TEST_P(TimeLines, TheNoteSaysWhatJumpedFromWhereToWhere) {
  fly(50s, 10);
  bench_.take(bench_.state(3s));
  auto note = *bench_.pilot->last_note();
  EXPECT_EQ(note.code, ErrorCode::kNotRising);
  EXPECT_EQ(note.field, "stamp");
  EXPECT_EQ(note.value, "3000000000 ns");
  EXPECT_THAT(note.sentence, HasSubstr("state: stamp jumped from 50180000000 ns to 3000000000 ns"));
  auto far = bench_.state(50s + 10 * kPeriod);
  far.sequence = kHugeSequence;
  bench_.take(far);
  note = *bench_.pilot->last_note();
  EXPECT_EQ(note.field, "sequence");
  EXPECT_THAT(note.sentence, HasSubstr("sequence jumped from 10 to 18446744073709551615"));
  auto frame = bench_.frame(3s);
  bench_.take(frame);
  EXPECT_THAT(bench_.pilot->last_note()->sentence, HasSubstr("depth: stamp jumped from 50180000000 ns"));
  const auto telemetry = bench_.telemetry();
  EXPECT_EQ(telemetry.last_code, ErrorCode::kNotRising);
  EXPECT_EQ(telemetry.last_field, "stamp");
  EXPECT_EQ(telemetry.last_value, "3000000000 ns");
  EXPECT_TRUE(protocol::validate(telemetry).ok()) << protocol::validate(telemetry).error();
}

TEST_P(TimeLines, OnePositionBeyondTheGatePassesNoGate) {
  fly(50s, 60);
  ASSERT_EQ(newest_.health.target_waypoint, 0u);
  const Eigen::Vector3d beyond(9.0, 0, 1.5);
  EXPECT_EQ(bench_.take(bench_.state(50s + 60 * kPeriod, beyond)), Outcome::kRejected);
  const Note note = *bench_.pilot->last_note();
  EXPECT_EQ(note.code, ErrorCode::kInvalid);
  EXPECT_EQ(note.field, "p_WB");
  EXPECT_THAT(note.sentence, HasSubstr("p_WB jumped from (1.18 0.00 1.50) m to (9.00 0.00 1.50) m"));
  bench_.step();
  fly(50s + 61 * kPeriod, 1);
  EXPECT_TRUE(told(Problem::kStatesRejected));
  EXPECT_EQ(newest_.answers_stamp, 50s + 61 * kPeriod);
  fly(50s + 62 * kPeriod, 60);
  EXPECT_EQ(newest_.health.target_waypoint, 0u);
  EXPECT_LE(longest_without_, kMayCost);
  EXPECT_EQ(newest_.health.problems, 0u);
  fly(50s + 122 * kPeriod, 178);
  EXPECT_EQ(newest_.health.target_waypoint, 1u) << "flown through";
}

TEST_P(TimeLines, AVehicleThatIsFoundBeyondTheGateDidNotFlyThroughIt) {
  fly(50s, 60);
  const auto found = [&](Bench* bench, int i) { return bench->take(bench->state(50s + i * kPeriod, {9.0, 0, 1.5})); };
  EXPECT_EQ(found(&bench_, 60), Outcome::kRejected);
  EXPECT_EQ(found(&bench_, 61), Outcome::kRejected);
  Bench moved(GetParam());
  moved.clock.set(bench_.clock.now());
  moved.state_sequence = bench_.state_sequence;
  const std::string saved = bench_.pilot->save();
  ASSERT_TRUE(moved.pilot->restore(saved).ok());
  EXPECT_EQ(moved.pilot->save(), saved);
  EXPECT_EQ(found(&moved, 62), Outcome::kTaken) << "three in a row agree";
  const auto* const command = moved.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(moved.planner->last.start.p_WB.x(), 9.0);
  EXPECT_EQ(command->health.target_waypoint, 0u);
  EXPECT_FALSE(command->health.degraded);
}

TEST_P(TimeLines, FramesAreNotBoundToAPlaceBetweenHereAndThere) {
  fly(50s, 10);
  for (int i = 10; i < 13; ++i) bench_.take(bench_.state(50s + i * kPeriod, {9.0, 0, 1.5}));
  auto frame = bench_.frame(50s + 11 * kPeriod);
  bench_.take(frame);
  bench_.look();
  EXPECT_THAT(bench_.telemetry().last_reason, HasSubstr("before the oldest state"));
}

TEST_P(TimeLines, MoveAlongWithASavedPilotAlsoHalfWay) {
  fly(500s, 30);
  bench_.take(bench_.state(0s));
  bench_.take(bench_.state(kPeriod));
  Bench moved(GetParam());
  moved.clock.set(bench_.clock.now());
  const std::string saved = bench_.pilot->save();
  ASSERT_TRUE(moved.pilot->restore(saved).ok());
  EXPECT_EQ(moved.pilot->save(), saved);
  EXPECT_EQ(moved.take(bench_.state(2 * kPeriod)), Outcome::kTaken);
  const auto* const command = moved.step();
  ASSERT_NE(command, nullptr);
  EXPECT_EQ(command->answers_stamp, 2 * kPeriod);
  moved.state_sequence = bench_.state_sequence;

  const std::string after = moved.pilot->save();
  Bench again(GetParam());
  ASSERT_TRUE(again.pilot->restore(after).ok());
  EXPECT_EQ(again.pilot->save(), after);
  EXPECT_EQ(again.take(moved.state(3 * kPeriod)), Outcome::kTaken);
}

INSTANTIATE_TEST_SUITE_P(Timings, TimeLines,
                         ::testing::Values(protocol::Timing::kLockstep, protocol::Timing::kRealTime),
                         [](const auto& timing) {
                           return timing.param == protocol::Timing::kLockstep ? "Lockstep" : "RealTime";
                         });

}  // namespace
}  // namespace gatefield::pilot
