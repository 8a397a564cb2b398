#include "server/pilot/disturbance.h"

#include <gtest/gtest.h>

#include "common/base/random.h"
#include "server/pilot/predictor.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

TEST(Disturbance, FindsWhatTheModelDoesNotKnow) {
  // Hovering with a mass of 10 % more than told, pushed by 1 m/s^2 along x, the velocity measured with 5 cm/s of noise.
  const QuadrotorModel told;
  QuadrotorModel truth = told;
  truth.mass_kg *= 1.1;
  truth.inertia_kg_m2 *= 1.1;
  QuadrotorState state;
  state.thrust_n = state.thrust_command_n = hover_thrust_n(told);
  const InputTimeline nothing_sent;
  Random random(5);
  Disturbance disturbance(0.5);
  for (int i = 0; i < 200; ++i) {
    QuadrotorState measured = state;
    measured.v_WB = Eigen::Vector3d::Zero();  // a small drag stays small
    state = measured;
    predict({.model = told}, nothing_sent, 0ms, 20ms, {0, 0, 0}, &measured);
    predict({.model = truth}, nothing_sent, 0ms, 20ms, {1, 0, 0}, &state);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    disturbance.observe(state.v_WB + 0.05 * noise - measured.v_WB, 20ms);
  }
  const Eigen::Vector3d& found = disturbance.acceleration_W_m_s2();
  EXPECT_NEAR(found.x(), 1.0, 0.6);
  EXPECT_NEAR(found.y(), 0.0, 0.6);
  EXPECT_NEAR(found.z(), -9.81 * (1 - 1 / 1.1), 0.6);
}

TEST(Disturbance, ACollisionIsNoWeather) {
  Disturbance disturbance(0.5);
  disturbance.observe({-8, 0, 0}, 20ms);
  EXPECT_LT(disturbance.acceleration_W_m_s2().norm(), 0.7);
  for (int i = 0; i < 100; ++i) disturbance.observe({-8, 0, 0}, 20ms);
  EXPECT_NEAR(disturbance.acceleration_W_m_s2().norm(), Disturbance::kMax_m_s2, 1e-9);
}

TEST(Disturbance, GapsAndNonsenseSayNothing) {
  Disturbance disturbance(0.5), off(0.0);
  disturbance.observe({1, 0, 0}, 300ms);
  disturbance.observe({std::nan(""), 0, 0}, 20ms);
  off.observe({1, 0, 0}, 20ms);
  EXPECT_EQ(disturbance.acceleration_W_m_s2().norm(), 0.0);
  EXPECT_EQ(off.acceleration_W_m_s2().norm(), 0.0);
}

}  // namespace
}  // namespace gatefield::pilot
