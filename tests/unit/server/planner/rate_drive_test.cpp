// Plans for vehicles that are asked for collective thrust and body rates.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "server/planner/planner.h"
#include "tests/support/analytic_field.h"
#include "tests/support/decoder_cases.h"

namespace gatefield::planner {
namespace {

using gates::AnalyticField;
using test::upright_gate;

Actuation rate_loop() { return {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}}; }

/// Both ways to sample.
class RateDrive : public ::testing::TestWithParam<bool> {
 protected:
  Profile profile() const {
    Profile profile;
    profile.samples = 512;
    profile.control_rate_hz = 50;
    profile.rates_by_changes = GetParam();
    return profile;
  }
  std::unique_ptr<Planner> make(const QuadrotorModel& model = {}) const {
    Course course;
    course.waypoints = {{{8, 0, 1.5}, {1, 0, 0}}};
    course.floor_z_m = 0.0;
    auto planner = Planner::create(profile(), model, course, kGuideConeAngle_rad, 1, {.actuation = rate_loop()});
    EXPECT_TRUE(planner.ok());
    return std::move(planner).value();
  }
};

PlanInput towards(const Eigen::Isometry3d& X_WG, const Field* field, const QuadrotorModel& model = {}) {
  PlanInput input;
  input.start.p_WB = {0, 0, 1.5};
  input.start.thrust_n = hover_thrust_n(model);
  input.asked = hover_command(model);
  input.target.center_W = X_WG.translation();
  input.target.axis_W = X_WG.linear().col(0);
  input.target.seen = field != nullptr;
  input.target.field = field;
  input.has_next = true;
  input.next.center_W = X_WG.translation() + 8.0 * X_WG.linear().col(0);
  input.next.axis_W = X_WG.linear().col(0);
  input.speed_limit_m_s = 6.0;
  return input;
}

TEST_P(RateDrive, FliesThroughAGateThatTheFieldShows) {
  const Eigen::Isometry3d X_WG = upright_gate({5, 0.6, 1.8}, 0.5);
  const AnalyticField field(X_WG);
  const auto planner = make();
  PlanInput input = towards(X_WG, &field);
  Plan plan;
  Eigen::Vector3d crossing_G(-1, 0, 0);
  for (input.step = 0; input.step < 150 && crossing_G.x() < 0; ++input.step) {
    planner->plan(input, &plan);
    ASSERT_TRUE(plan.ok);
    ASSERT_EQ(plan.thrust_rate_n_s[0], ThrustRates(ThrustRates::Zero()));
    const RateCommand& asked = plan.rate_command[0];
    for (int ms = 0; ms < 20 && crossing_G.x() < 0; ++ms) {
      const double before = (X_WG.inverse() * input.start.p_WB).x();
      input.start = step_body_rates(QuadrotorModel{}, rate_loop(), input.start, asked, asked, 1e-3);
      const Eigen::Vector3d p_G = X_WG.inverse() * input.start.p_WB;
      if (before < 0 && p_G.x() >= 0) crossing_G = p_G;
    }
    input.asked = asked;
    input.elapsed_s = 0.02;
  }
  EXPECT_GE(crossing_G.x(), 0.0);
  EXPECT_LT(std::max(std::abs(crossing_G.y()), std::abs(crossing_G.z())), 0.5 - 0.13);
}

TEST_P(RateDrive, AsksForNothingBeyondTheLimits) {
  QuadrotorModel model;
  model.body_rate_max_rad_s = {2.0, 100.0, 0.5};
  const auto planner = make(model);
  // The gate abeam and above: it turns, and climbs.
  PlanInput input = towards(upright_gate({-2, 6, 5}, 1.57), nullptr, model);
  Plan plan;
  const double weight_n = model.mass_kg * kGravity_m_s2;
  double largest_yaw_rad_s = 0.0, largest_thrust_n = 0.0;
  for (input.step = 0; input.step < 40; ++input.step) {
    planner->plan(input, &plan);
    for (int k = 0; k < plan.steps; ++k) {
      const RateCommand& asked = plan.rate_command[static_cast<std::size_t>(k)];
      const Profile limits = profile();
      ASSERT_LE(std::abs(asked[1]), 2.0);
      ASSERT_LE(std::abs(asked[2]), limits.rates_tilt_limit_rad_s) << "the profile's, where the vehicle allows more";
      ASSERT_LE(std::abs(asked[3]), 0.5);
      ASSERT_GE(asked[0], std::min(limits.rates_thrust_low * kRotors * model.thrust_max_n, 0.5 * weight_n) - 1e-9);
      ASSERT_LE(asked[0], limits.rates_thrust_high * kRotors * model.thrust_max_n + 1e-9);
      largest_yaw_rad_s = std::max(largest_yaw_rad_s, std::abs(asked[3]));
      largest_thrust_n = std::max(largest_thrust_n, asked[0]);
    }
    input.elapsed_s = 0.03;
    input.start = plan.state[0];
    input.asked = plan.rate_command[0];
  }
  EXPECT_GT(largest_yaw_rad_s, 0.4) << "the limit was come to";
  EXPECT_GT(largest_thrust_n, 1.2 * weight_n);
}

TEST_P(RateDrive, AVehicleOfLittleThrustMayUseWhatItHasAboveTheHover) {
  QuadrotorModel model;
  model.thrust_max_n = 1.15 * model.mass_kg * kGravity_m_s2 / kRotors;
  const auto planner = make(model);
  PlanInput input = towards(upright_gate({0, 6, 4}, 1.57), nullptr, model);
  Plan plan;
  planner->plan(input, &plan);
  const double weight_n = model.mass_kg * kGravity_m_s2;
  double most_n = 0.0;
  for (input.step = 1; input.step < 20; ++input.step) {
    planner->plan(input, &plan);
    input.elapsed_s = 0.03;
    input.start = plan.state[0];
    most_n = std::max(most_n, plan.rate_command[0][0]);
  }
  EXPECT_GT(most_n, weight_n) << "80 % of its thrust would not lift it";
}

TEST_P(RateDrive, NothingOfAnOldPlanIsLeftAfterAnOutage) {
  const Eigen::Isometry3d X_WG = upright_gate({0, 6, 4}, 1.57);
  const auto used = make(), fresh = make();
  PlanInput input = towards(X_WG, nullptr);
  Plan before, after, expected;
  for (input.step = 0; input.step < 10; ++input.step) {
    used->plan(input, &before);
    input.elapsed_s = 0.02;
  }
  input.elapsed_s = 2.0;
  used->plan(input, &after);
  fresh->plan(input, &expected);
  for (std::size_t k = 0; k < static_cast<std::size_t>(after.steps); ++k)
    EXPECT_EQ(after.rate_command[k], expected.rate_command[k]) << k;
}

TEST_P(RateDrive, AStrongerVehicleIsAskedForLess) {
  // Hovering at the waypoint behind the last gate.
  const auto asked_for = [this](double factor) {
    const auto planner = make();
    PlanInput input = towards(upright_gate({0, 0, 1.5}, 0.0), nullptr);
    input.hold = true;
    input.thrust_factor = factor;
    Plan plan;
    double sum_n = 0.0;
    for (input.step = 0; input.step < 100; ++input.step) {
      planner->plan(input, &plan);
      input.elapsed_s = 0.03;
      input.start = plan.state[0];
      input.asked = plan.rate_command[0];
      if (input.step >= 50) sum_n += plan.rate_command[0][0];
    }
    return sum_n / 50;
  };
  EXPECT_NEAR(asked_for(1.25) / asked_for(1.0), 0.8, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Sampling, RateDrive, ::testing::Bool(),
                         [](const auto& by_changes) { return by_changes.param ? "Changes" : "Commands"; });

}  // namespace
}  // namespace gatefield::planner
