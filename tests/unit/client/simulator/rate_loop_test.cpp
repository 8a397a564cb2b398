#include "client/simulator/rate_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "client/simulator/plant.h"
#include "common/config/locate.h"
#include "common/config/vehicle.h"
#include "tests/support/allocation_trap.h"

namespace gatefield::simulator {
namespace {

using testing::HasSubstr;

const Eigen::Vector3d kTold_s(0.0425, 0.0425, 0.08);

/// The loop on a vehicle that hovers, in MuJoCo's world.
class Flown {
 public:
  explicit Flown(const QuadrotorModel& model = {}, const Eigen::Vector3d& told_s = kTold_s)
      : weight_n_(model.mass_kg * kGravity_m_s2), loop_(model, tuned_gains(model, told_s).value()) {
    scene::World world;
    world.has_floor = false;
    plant_ = Plant::create(world, model).value();
    QuadrotorState state;
    state.p_WB = {0, 0, 100};
    state.thrust_n = state.thrust_command_n = hover_thrust_n(model);
    plant_->set_state(state);
  }

  const QuadrotorState& state() const { return plant_->state(); }
  double weight_n() const { return weight_n_; }
  void step(double collective_n, const Eigen::Vector3d& w_asked_B) {
    plant_->step_held(loop_.update(collective_n, w_asked_B, state().w_WB_B));
  }

 private:
  double weight_n_;
  RateLoop loop_;
  std::unique_ptr<Plant> plant_;
};

struct Response {
  double at_63_percent_s = NAN;
  double overshoot = 0.0;
  double end = 0.0;  ///< of what was asked for, after 0.6 s
};

Response step_response(Flown flown, Eigen::Index axis, double rate_rad_s) {
  const Eigen::Vector3d asked = rate_rad_s * Eigen::Vector3d::Unit(axis);
  Response response;
  double before = 0.0;
  for (int i = 0; i < 600; ++i) {
    flown.step(flown.weight_n(), asked);
    const double share = flown.state().w_WB_B[axis] / rate_rad_s;
    constexpr double kGoal = 1.0 - 1.0 / std::numbers::e;
    if (share >= kGoal && std::isnan(response.at_63_percent_s))
      response.at_63_percent_s = 1e-3 * (i + (kGoal - before) / (share - before));
    response.overshoot = std::max(response.overshoot, share - 1.0);
    before = response.end = share;
  }
  return response;
}

TEST(RateLoop, AStepOfTheRacerComesInAsToldWithSomeOvershoot) {
  for (const Eigen::Index axis : {0, 1})
    for (const double rate_rad_s : {-1.0, 3.0}) {
      const Response roll = step_response(Flown(), axis, rate_rad_s);
      EXPECT_NEAR(roll.at_63_percent_s, 0.042, 0.002) << axis;
      EXPECT_NEAR(roll.overshoot, 0.07, 0.02) << axis;
      EXPECT_NEAR(roll.end, 1.0, 0.03) << axis;
    }
  EXPECT_NEAR(step_response(Flown(), 2, 0.5).at_63_percent_s, 0.08, 0.004);
  EXPECT_NEAR(step_response(Flown(), 2, 3.0).at_63_percent_s, 0.12, 0.015) << "torque about z is scarce";
}

TEST(RateLoop, OtherPacesAndOtherVehiclesAreMetWithinTenPercent) {
  for (const double rotors_s : {0.015, 0.025, 0.05}) {
    QuadrotorModel model;
    model.rotor_time_constant_s = rotors_s;
    for (const double pace : {1.14, 1.7, 2.55, 2.65, 4.0, 6.0}) {
      const double told_s = pace * rotors_s;
      const Response response = step_response(Flown(model, Eigen::Vector3d::Constant(told_s)), 0, 0.5);
      EXPECT_NEAR(response.at_63_percent_s / told_s, 1.0, 0.10) << rotors_s << ' ' << pace;
      EXPECT_LT(response.overshoot, 0.09) << rotors_s << ' ' << pace;
    }
  }
  QuadrotorModel heavy;
  heavy.mass_kg *= 3;
  heavy.inertia_kg_m2 *= 3;
  heavy.thrust_max_n *= 3;
  EXPECT_NEAR(step_response(Flown(heavy), 0, 3.0).at_63_percent_s, 0.042, 0.002);
}

// What a vehicle's file says of its flight controller is what the loop here does with the vehicle; but for those whose
// flight controller is another one, which tests with that one measure.
TEST(RateLoop, TheLagsOfTheShippedVehiclesAreThoseOfTheLoop) {
  int looked_at = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*config::config_folder() / "vehicles")) {
    const auto vehicle = config::load_vehicle(entry.path());
    ASSERT_TRUE(vehicle.ok()) << vehicle.error();
    if (vehicle->actuation.kind != Actuation::Kind::kBodyRates) continue;
    if (entry.path().stem() == "racer-betaflight") continue;
    ++looked_at;
    const auto& told = vehicle->actuation;
    for (const auto& [axis, rate_rad_s] : {std::pair(0, 3.0), std::pair(1, 3.0), std::pair(2, 0.5)}) {
      const Response response = step_response(Flown(vehicle->quadrotor, told.rate_time_constant_s), axis, rate_rad_s);
      EXPECT_NEAR(response.at_63_percent_s / told.rate_time_constant_s[axis], 1.0, 0.05) << entry.path() << axis;
    }
    Flown flown(vehicle->quadrotor, told.rate_time_constant_s);
    double after_s = 0;
    const double goal_n = flown.weight_n() * (1.0 + 0.2 * (1.0 - 1.0 / std::numbers::e));
    for (; flown.state().thrust_n.sum() < goal_n && after_s < 1.0; after_s += 1e-3)
      flown.step(1.2 * flown.weight_n(), Eigen::Vector3d::Zero());
    EXPECT_NEAR(after_s / told.thrust_time_constant_s, 1.0, 0.05) << entry.path();
    config::Vehicle silent;
    silent.quadrotor = vehicle->quadrotor;
    const Actuation usual = config::driven_by(silent, Actuation::Kind::kBodyRates);
    EXPECT_LT((usual.rate_time_constant_s - told.rate_time_constant_s).norm(), 1e-9) << "for a file that says nothing";
  }
  EXPECT_GE(looked_at, 3);
}

TEST(RateLoop, APaceBeyondTheRotorsIsRefused) {
  const auto gains = tuned_gains({}, Eigen::Vector3d(0.04, 0.019, 0.1));
  ASSERT_FALSE(gains.ok());
  EXPECT_EQ(gains.failure().field, "rate_time_constant_s[1]");
  EXPECT_THAT(gains.error(), HasSubstr("rate_time_constant_s[1] is 0.019 s, expected at least 0.02 s"));
  EXPECT_FALSE(tuned_gains({}, Eigen::Vector3d(0.04, NAN, 0.1)).ok());
}

TEST(RateLoop, HoversAndTurnsWithoutLosingHeightOrLevel) {
  Flown flown;
  for (int i = 0; i < 2000; ++i) flown.step(flown.weight_n(), {0, 0, 1});
  EXPECT_NEAR(flown.state().w_WB_B.z(), 1.0, 0.02);
  EXPECT_NEAR(flown.state().p_WB.z(), 100, 0.01);
  EXPECT_LT(flown.state().w_WB_B.head<2>().norm(), 1e-9);
}

TEST(RateLoop, TheRotorsStayBetweenIdlingAndFullThrustAndStillTurnTheVehicle) {
  const QuadrotorModel model;
  for (const double collective_n : {-5.0, 0.0, 40.0, 100.0}) {
    RateLoop loop(model, tuned_gains(model, kTold_s).value());
    const PlainVector4 thrust_n = loop.update(collective_n, {3, -2, 0}, Eigen::Vector3d::Zero());
    EXPECT_GE(thrust_n.minCoeff(), 0.2 - 1e-12) << "idling is 2 % of the range";
    EXPECT_LE(thrust_n.maxCoeff(), model.thrust_max_n);
    const Eigen::Vector3d torque_B = rotor_torque_B(model, thrust_n);
    EXPECT_GT(torque_B.x(), 0.3);
    EXPECT_LT(torque_B.y(), -0.2);
  }
}

TEST(RateLoop, YawGivesWayToRollAndPitchAndCollectiveThrustToAll) {
  const QuadrotorModel model;
  const auto turned = [&](const Eigen::Vector3d& asked, double collective_n) {
    RateLoop loop(model, tuned_gains(model, kTold_s).value());
    return loop.update(collective_n, asked, Eigen::Vector3d::Zero());
  };
  const double hover_n = model.mass_kg * kGravity_m_s2;
  const PlainVector4 level_n = turned({15, 0, 0}, hover_n), with_yaw_n = turned({15, 0, 6}, hover_n);
  EXPECT_NEAR(level_n.maxCoeff() - level_n.minCoeff(), model.thrust_max_n - 0.2, 1e-9) << "the whole room is used";
  EXPECT_LT((level_n - with_yaw_n).norm(), 1e-9) << "nothing is left for yaw";
  EXPECT_NEAR(turned({1, 0, 0}, hover_n).sum(), hover_n, 1e-9) << "what fits keeps the thrust asked for";
  EXPECT_GT(turned({3, 0, 0}, 0.8).sum(), 4.0) << "thrust rises to turn";
  EXPECT_LT(turned({3, 0, 0}, 40.0).sum(), 36.0) << "thrust falls to turn";
}

TEST(RateLoop, WhatTheRotorsCouldNotGiveIsNotAskedForAfterwards) {
  Flown flown;
  for (int i = 0; i < 2000; ++i) flown.step(flown.weight_n(), {0, 0, 60});  // far more than two seconds of torque give
  ASSERT_LT(flown.state().w_WB_B.z(), 45);
  double most_rad_s = 0;
  const double reached_rad_s = flown.state().w_WB_B.z();
  for (int i = 0; i < 500; ++i) {
    flown.step(flown.weight_n(), {0, 0, reached_rad_s});
    most_rad_s = std::max(most_rad_s, flown.state().w_WB_B.z());
  }
  EXPECT_LT(most_rad_s, reached_rad_s + 1.0) << "no wound-up integral turns it on";
}

TEST(RateLoop, ASteadyTorqueIsHeldAgainst) {
  QuadrotorModel lopsided;  // the loop does not know it: one rotor sits farther out in truth
  const QuadrotorModel told;
  lopsided.rotor_position_B_m[0] *= 1.02;
  scene::World world;
  world.has_floor = false;
  auto plant = Plant::create(world, lopsided).value();
  QuadrotorState state;
  state.p_WB = {0, 0, 100};
  state.thrust_n = state.thrust_command_n = hover_thrust_n(told);
  plant->set_state(state);
  RateLoop loop(told, tuned_gains(told, kTold_s).value());
  const auto fly = [&](int steps) {
    for (int i = 0; i < steps; ++i)
      plant->step_held(loop.update(told.mass_kg * kGravity_m_s2, Eigen::Vector3d::Zero(), plant->state().w_WB_B));
    return plant->state().w_WB_B.head<2>().norm();
  };
  const double soon_rad_s = fly(300);
  EXPECT_GT(soon_rad_s, 1e-3);
  EXPECT_LT(fly(4000), 0.1 * soon_rad_s);
}

TEST(RealTime, ARateLoopDoesNotAllocate) {
  RateLoop loop({}, tuned_gains({}, kTold_s).value());
  const test::AllocationTrap trap;
  double sum_n = 0;
  for (int i = 0; i < 100; ++i) sum_n += loop.update(8.0, {1, -2, 0.1 * i}, {0.1, 0.2, 0.3}).sum();
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_GT(sum_n, 0);
}

}  // namespace
}  // namespace gatefield::simulator
