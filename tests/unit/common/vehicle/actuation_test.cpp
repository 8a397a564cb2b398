#include "common/vehicle/actuation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gatefield {
namespace {

Actuation rate_loop() {
  Actuation actuation;
  actuation.kind = Actuation::Kind::kBodyRates;
  actuation.thrust_time_constant_s = 0.03;
  actuation.rate_time_constant_s = {0.04, 0.05, 0.12};
  return actuation;
}

QuadrotorState racing_state() {
  QuadrotorState state;
  state.v_WB = {5.0, -2.0, 0.3};
  state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d(0.3, -0.8, 0.5).normalized()));
  state.w_WB_B = {1.0, -2.0, 0.5};
  state.thrust_n.setConstant(2.5);
  return state;
}

TEST(StepBodyRates, SixtyThreePercentOfAStepComeInOneTimeConstant) {
  const QuadrotorModel model;
  QuadrotorState state;
  state.thrust_n = hover_thrust_n(model);
  const RateCommand command{2.0 * model.mass_kg * kGravity_m_s2, 3.0, 0.0, 0.0};
  const double one_lag_s = rate_loop().rate_time_constant_s[0];
  const QuadrotorState after = step_body_rates(model, rate_loop(), state, command, command, one_lag_s);
  EXPECT_NEAR(after.w_WB_B.x(), 3.0 * (1.0 - std::exp(-1.0)), 1e-12);
  EXPECT_NEAR(after.w_WB_B.y(), 0.0, 1e-12);
  EXPECT_NEAR(after.thrust_n.sum() / command[0], 0.5 + 0.5 * (1.0 - std::exp(-0.04 / 0.03)), 1e-12);
  EXPECT_NEAR(after.thrust_command_n.sum(), command[0], 1e-12);
}

TEST(StepBodyRates, ThrustAndRatesAreTheSameInOneStepAndInMany) {
  const QuadrotorModel model;
  const RateCommand begin{6.0, 1.0, -1.0, 0.0}, end{14.0, -4.0, 3.0, 2.0};
  const QuadrotorState once = step_body_rates(model, rate_loop(), racing_state(), begin, end, 0.03);
  QuadrotorState many = racing_state();
  for (int i = 0; i < 30; ++i) {
    const auto at = [&](double part) { return RateCommand(begin + part * (end - begin)); };
    many = step_body_rates(model, rate_loop(), many, at(i / 30.0), at((i + 1) / 30.0), 0.001);
  }
  EXPECT_LT((once.w_WB_B - many.w_WB_B).norm(), 1e-9);
  EXPECT_NEAR(once.thrust_n.sum(), many.thrust_n.sum(), 1e-9);
  // The body's discretisation is of first order in drag and in the bend of the path.
  EXPECT_LT((once.p_WB - many.p_WB).norm(), 2e-3);
  EXPECT_LT((once.v_WB - many.v_WB).norm(), 2e-2);
  EXPECT_LT(once.q_WB.angularDistance(many.q_WB), 5e-3);
}

TEST(StepBodyRates, AFactorOnTheThrustPushesAsMuchMore) {
  const QuadrotorModel model;
  QuadrotorState state;
  state.thrust_n = hover_thrust_n(model);
  const RateCommand hover = hover_command(model);
  EXPECT_LT(step_body_rates(model, rate_loop(), state, hover, hover, 0.1).v_WB.norm(), 1e-12);
  EXPECT_NEAR(step_body_rates(model, rate_loop(), state, hover, hover, 0.1, 1.1).v_WB.z(), 0.1 * 0.1 * kGravity_m_s2,
              1e-12);
}

}  // namespace
}  // namespace gatefield
