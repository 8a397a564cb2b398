// A vehicle of body rates that is asked for something else than the plans.

#include <gtest/gtest.h>

#include <cmath>

#include "server/pilot/pilot.h"
#include "tests/unit/server/pilot/fakes.h"

namespace gatefield::pilot {
namespace {

using protocol::AskedBy;
using testing::Bench;
using namespace std::chrono_literals;

const Actuation kActuation = {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}};
constexpr protocol::Problems kDriveUnlikeTold =
    bit(protocol::Problem::kThrustUnlikeTold) | bit(protocol::Problem::kRateLoopUnlikeTold);

/// Flies as told, but by a supervisor: it sways about a hover. Plans ask for much less thrust and a steady turn all the
/// while. States come every 20 ms, its setpoints every 5.
class Supervised {
 public:
  explicit Supervised(protocol::Timing timing = protocol::Timing::kLockstep)
      : bench(timing, testing::small_profile(), kActuation) {
    bench.planner->rate_command = {0.6 * weight_n(), 0.3, -0.3, 0.5};
    state_.p_WB = {0, 0, 1.5};
    state_.thrust_n = state_.thrust_command_n = hover_thrust_n(bench.request.quadrotor);
  }

  double weight_n() const { return bench.request.quadrotor.mass_kg * kGravity_m_s2; }
  RateCommand asked() const {
    const double t = seconds(now_);
    const auto wave = [t](double hz, double phase) { return std::sin(6.28 * hz * t + phase); };
    return {weight_n() * (1.0 + 0.1 * wave(0.6, 0)), 1.2 * wave(1.5, 0), 1.2 * wave(1.3, 1), 1.5 * wave(0.9, 2)};
  }
  /// @param told  as which the states tell asked()
  void fly(Stamp span, AskedBy told, double truth = 1.0) {
    for (const Stamp until = now_ + span; now_ < until;) {
      protocol::VehicleState sample = bench.state(now_);
      sample.state = state_;
      sample.state.thrust_n.setZero();
      sample.state.thrust_command_n.setZero();
      sample.thrust_known = false;
      sample.asked.by = told;
      if (sample.asked.told()) sample.asked.command = asked();
      ASSERT_EQ(bench.take(sample), Intake::Outcome::kTaken);
      const auto* const command = bench.step();
      ASSERT_NE(command, nullptr);
      problems |= command->health.problems;
      for (int i = 0; i < 4; ++i, now_ += 5ms) {
        const RateCommand held = asked();
        for (int k = 0; k < 5; ++k)
          state_ = step_body_rates(bench.request.quadrotor, kActuation, state_, held, held, 1e-3, truth);
      }
      bench.clock.advance(20ms);
    }
  }
  protocol::IdentifiedDrive found() const { return bench.telemetry().identified; }

  Bench bench;
  protocol::Problems problems = 0;

 private:
  QuadrotorState state_;
  Stamp now_ = 50s;
};

TEST(PilotAsked, WhatIsToldIsWhatThrustAndLagsAreFoundBy) {
  Supervised vehicle;
  vehicle.fly(6s, AskedBy::kOther);
  EXPECT_EQ(vehicle.problems & kDriveUnlikeTold, 0u);
  EXPECT_NEAR(vehicle.found().thrust_factor, 1.0, 0.02);
  for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(vehicle.found().rate_time_constant_s[axis], 0.04, 0.01) << axis;
}

TEST(PilotAsked, AThrustUnlikeToldIsFoundUnderASupervisorToo) {
  Supervised vehicle;
  vehicle.fly(6s, AskedBy::kOther, 1.25);
  EXPECT_NEAR(vehicle.found().thrust_factor, 1.25, 0.03);
  EXPECT_NE(vehicle.problems & bit(protocol::Problem::kThrustUnlikeTold), 0u);
}

TEST(PilotAsked, UntoldTheVehicleSeemsToFollowItsPlansBadly) {
  Supervised vehicle;
  vehicle.fly(6s, AskedBy::kPlans);
  EXPECT_NE(vehicle.problems & bit(protocol::Problem::kThrustUnlikeTold), 0u) << "what telling is there for";
}

TEST(PilotAsked, OfWhatNobodyKnowsNothingIsFound) {
  Supervised vehicle;
  vehicle.fly(6s, AskedBy::kUnknown);
  EXPECT_EQ(vehicle.problems & kDriveUnlikeTold, 0u);
  EXPECT_EQ(vehicle.found().thrust_factor, 0.0) << "not known";
  EXPECT_TRUE(vehicle.found().rate_time_constant_s.isZero());
}

TEST(PilotAsked, APlanBeginsFromWhatIsAskedForThen) {
  Supervised vehicle;
  vehicle.fly(100ms, AskedBy::kPlans);
  EXPECT_EQ(vehicle.bench.planner->last.asked, vehicle.bench.planner->rate_command);
  const RateCommand asked = vehicle.asked();
  vehicle.fly(20ms, AskedBy::kOther);
  EXPECT_EQ(vehicle.bench.planner->last.asked, asked);
  vehicle.fly(20ms, AskedBy::kPlans);
  EXPECT_EQ(vehicle.bench.planner->last.asked, vehicle.bench.planner->rate_command) << "and on along the plans";
}

TEST(PilotAsked, AVehicleOfRotorThrustsSaysItByItsRotors) {
  const auto start = [](AskedBy by) {
    Bench bench(protocol::Timing::kLockstep);
    for (int i = 0; i < 5; ++i) {
      auto state = bench.state(50s + i * 20ms);
      state.round_trip = 60ms;
      state.asked = {by, RateCommand::Constant(3.0)};
      bench.take(state);
      bench.step();
    }
    return bench.planner->last.start;
  };
  EXPECT_EQ(start(AskedBy::kOther).p_WB, start(AskedBy::kPlans).p_WB);
  EXPECT_EQ(start(AskedBy::kOther).thrust_n, start(AskedBy::kPlans).thrust_n);
}

}  // namespace
}  // namespace gatefield::pilot
