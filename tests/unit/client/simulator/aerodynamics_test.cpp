#include "client/simulator/aerodynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/simulator/plant.h"

namespace gatefield::simulator {
namespace {

using config::WorldPart;

const Eigen::Vector3d kNoWind = Eigen::Vector3d::Zero();

Aerodynamics with(const std::vector<WorldPart>& parts, const QuadrotorModel& model = {}, std::uint64_t seed = 1) {
  scene::World world;
  world.floor_z_m = 0.5;
  return Aerodynamics::create(config::hard_world(parts).air, model, world, seed).value();
}

QuadrotorState hovering(const Eigen::Vector3d& p_WB = {0, 0, 50}) {
  QuadrotorState state;
  state.p_WB = p_WB;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(QuadrotorModel());
  return state;
}

TEST(Aerodynamics, NoneOfAnEasyWorld) {
  EXPECT_FALSE(Aerodynamics::create({}, {}, {}, 1));
  EXPECT_FALSE(Aerodynamics::create(config::hard_world({WorldPart::kDrift}).air, {}, {}, 1));
}

TEST(Aerodynamics, ThrustFallsStraightWithAxialSpeedUntilTheAdvanceRatioIsReached) {
  const auto air = with({WorldPart::kInflow});
  QuadrotorState state = hovering();
  const double still_n = state.thrust_n[0];
  EXPECT_NEAR(air.thrust_n(state, kNoWind)[0], still_n, 1e-12);
  // Revolutions from T = C_T rho n^2 D^4; without thrust at v = J_0 n D.
  const double diameter_m = 1.17 * 0.0771 * std::sqrt(2.0);
  const double n_hz = std::sqrt(still_n / (0.11 * 1.2 * std::pow(diameter_m, 4)));
  const double none_m_s = 0.9 * n_hz * diameter_m;
  EXPECT_NEAR(none_m_s, 27.7, 0.5);
  for (const double share : {0.1, 0.5, 0.9}) {
    state.v_WB.z() = share * none_m_s;
    EXPECT_NEAR(air.thrust_n(state, kNoWind)[1], (1.0 - share) * still_n, 1e-9) << share;
  }
  EXPECT_NEAR(air.thrust_n(state, state.v_WB)[1], still_n, 1e-9) << "it is the air's speed that counts";
  state.v_WB.z() = 2.0 * none_m_s;
  EXPECT_EQ(air.thrust_n(state, kNoWind)[2], 0.0);
  state.v_WB.z() = -2.0 * none_m_s;
  EXPECT_NEAR(air.thrust_n(state, kNoWind)[2], Aerodynamics::kMostOfStatic * still_n, 1e-9);
}

TEST(Aerodynamics, ATurningVehicleIsDampedByItsRotors) {
  const QuadrotorModel model;
  const auto air = with({WorldPart::kInflow});
  QuadrotorState state = hovering();
  state.w_WB_B = {5, 0, 0};
  EXPECT_LT(rotor_torque_B(model, air.thrust_n(state, kNoWind)).x(), 0.0);
}

TEST(Aerodynamics, GroundEffectIsThatOfCheesemanAndBennett) {
  const auto air = with({WorldPart::kGroundEffect});
  const double radius_m = 0.5 * 1.17 * 0.0771 * std::sqrt(2.0);
  const auto factor = [&](double height_m) {
    const QuadrotorState state = hovering({0, 0, 0.5 + height_m});
    return air.thrust_n(state, kNoWind)[3] / state.thrust_n[3];
  };
  EXPECT_NEAR(factor(radius_m), 16.0 / 15.0, 1e-9);
  EXPECT_NEAR(factor(0.1 * radius_m), 16.0 / 15.0, 1e-9) << "no more than at one radius";
  EXPECT_NEAR(factor(2 * radius_m), 64.0 / 63.0, 1e-9);
  EXPECT_NEAR(factor(1.5), 1.0, 2e-4) << "at gates it is nothing";
  EXPECT_GT(factor(1.5), 1.0);
}

TEST(Aerodynamics, DragGrowsWithTheSquareOfTheSpeedAgainstIt) {
  const auto air = with({WorldPart::kDrag});
  QuadrotorState state = hovering();
  state.v_WB = {4, 0, 0};
  const Eigen::Vector3d slow_W = air.drag_W(state, kNoWind);
  const double arm2_m2 = 2 * 0.0771 * 0.0771;
  EXPECT_NEAR(slow_W.x(), -0.5 * 1.2 * 1.2 * arm2_m2 * 16, 1e-9);
  EXPECT_NEAR(slow_W.tail<2>().norm(), 0.0, 1e-12);
  state.v_WB *= 2;
  EXPECT_TRUE(air.drag_W(state, kNoWind).isApprox(4 * slow_W, 1e-12));
  EXPECT_NEAR(air.drag_W(state, state.v_WB).norm(), 0.0, 1e-12);
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitY()));  // on its face
  EXPECT_NEAR(air.drag_W(state, kNoWind).x(), 4 * slow_W.x() * 2.5 / 1.2, 1e-9);
}

TEST(Aerodynamics, TheChargeIsDrawnFromTheSeedWithinItsBounds) {
  const config::AirErrors sizes = config::hard_world({WorldPart::kBattery}).air;
  const double least = Battery(sizes, sizes.charge_low).factor(1.0),
               most = Battery(sizes, sizes.charge_high).factor(1.0);
  double low = 2, high = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const double factor = with({WorldPart::kBattery}, {}, seed).battery_factor();
    EXPECT_EQ(factor, with({WorldPart::kBattery}, {}, seed).battery_factor());
    low = std::min(low, factor);
    high = std::max(high, factor);
  }
  EXPECT_GE(low, least);
  EXPECT_LE(high, most);
  EXPECT_LT(low, least + 0.02);
  EXPECT_GT(high, most - 0.02);
}

TEST(Aerodynamics, FullThrustSagsAndComesBack) {
  auto air = with({WorldPart::kBattery});
  const double rest = air.battery_factor();
  for (int i = 0; i < 200; ++i) air.pass(PlainVector4::Constant(10.0), 1e-3);
  EXPECT_LT(air.battery_factor(), 0.85 * rest);
  for (int i = 0; i < 200; ++i) air.pass(hover_thrust_n({}) / rest, 1e-3);
  EXPECT_NEAR(air.battery_factor(), rest, 0.01);
}

TEST(HardPlant, HoversAtTheSettingThatItsBatteryNeeds) {
  const QuadrotorModel model;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    scene::World world;
    world.has_floor = false;
    auto plant = Plant::create(world, model, kNoWind,
                               Aerodynamics::create(config::hard_world({WorldPart::kHard}).air, model, world, seed))
                     .value();
    QuadrotorState state = hovering();
    state.thrust_n = state.thrust_command_n = plant->hover_setting_n();
    EXPECT_GT(std::abs(state.thrust_n[0] - hover_thrust_n(model)[0]), 1e-4) << "seed " << seed;
    plant->set_state(state);
    for (int i = 0; i < 500; ++i) plant->step(ThrustRates::Zero());
    EXPECT_LT((plant->state().p_WB - state.p_WB).norm(), 0.01) << "seed " << seed;
  }
}

TEST(HardPlant, ComesToASlowerTopSpeedThanItsModel) {
  const QuadrotorModel model;
  scene::World world;
  world.has_floor = false;
  const auto speed = [&](const std::vector<WorldPart>& parts) {
    auto plant =
        Plant::create(world, model, kNoWind, Aerodynamics::create(config::hard_world(parts).air, model, world, 1))
            .value();
    QuadrotorState state = hovering();
    state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.8, Eigen::Vector3d::UnitY()));
    state.thrust_n = state.thrust_command_n = PlainVector4::Constant(3.0);
    plant->set_state(state);
    for (int i = 0; i < 3000; ++i) plant->step(ThrustRates::Zero());
    return plant->state().v_WB.x();
  };
  const double easy_m_s = speed({});
  EXPECT_LT(speed({WorldPart::kDrag}), 0.85 * easy_m_s);
  EXPECT_LT(speed({WorldPart::kInflow}), 0.95 * easy_m_s);
}

}  // namespace
}  // namespace gatefield::simulator
