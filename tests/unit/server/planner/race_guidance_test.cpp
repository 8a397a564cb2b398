#include "server/planner/race_guidance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tests/support/analytic_field.h"

namespace gatefield::planner {
namespace {

/// Target gate at (10, 0, 1.5), passed along +x, the vehicle `distance_m` before it.
PlanInput before_gate(double distance_m, bool seen = true) {
  PlanInput input;
  input.target.center_W = {10, 0, 1.5};
  input.target.seen = seen;
  input.start.p_WB = {10 - distance_m, 0, 1.5};
  return input;
}

/// A course of which guidance wants nothing but its heights.
Course course_at(double lowest_m, std::optional<double> floor_m = {}) {
  Course course;
  course.waypoints = {{{10, 0, lowest_m}, {1, 0, 0}}, {{18, 0, lowest_m + 2}, {1, 0, 0}}};
  course.floor_z_m = floor_m;
  return course;
}

RaceGuidance guidance(const Profile& profile = {}, const QuadrotorModel& model = {}) {
  return RaceGuidance(profile, model, course_at(1.5, 0.0), kGuideConeAngle_rad);
}

TEST(Tighten, FarFromTheGateTheLimitIsTheSessionsOrTheProfiles) {
  PlanInput input = before_gate(6.0, false);
  input.field_age_s = 100.0;
  EXPECT_EQ(tighten(Profile{}, input).speed_limit_m_s, Profile{}.speed_limit_m_s);
  input.speed_limit_m_s = 11.0;
  EXPECT_EQ(tighten(Profile{}, input).speed_limit_m_s, 11.0);
  EXPECT_EQ(tighten(Profile{}, input).extra_clearance_m, 0.0);
}

TEST(Tighten, NearAGateThatWasNeverSeenItIsSlower) {
  PlanInput input = before_gate(3.0, false);
  input.speed_limit_m_s = 10.0;
  EXPECT_DOUBLE_EQ(tighten(Profile{}, input).speed_limit_m_s, 6.0);
}

TEST(Tighten, NearAGateGrowsWithTheAgeOfItsFieldUpToABound) {
  const Profile profile;  // fresh until 0.6 s, stale from 2 s on
  PlanInput input = before_gate(3.0);
  input.speed_limit_m_s = 10.0;
  const auto at = [&](double age_s) {
    input.field_age_s = age_s;
    return tighten(profile, input);
  };
  EXPECT_DOUBLE_EQ(at(0.5).speed_limit_m_s, 10.0);
  EXPECT_NEAR(at(1.3).speed_limit_m_s, 7.5, 1e-9);
  EXPECT_NEAR(at(1.3).extra_clearance_m, 0.05, 1e-9);
  EXPECT_DOUBLE_EQ(at(50.0).speed_limit_m_s, 5.0);
  EXPECT_DOUBLE_EQ(at(50.0).extra_clearance_m, 0.1);
}

TEST(Tighten, HoldingSlowsDownTowardsThePoint) {
  PlanInput input = before_gate(4.0);
  input.hold = true;
  EXPECT_DOUBLE_EQ(tighten(Profile{}, input).speed_limit_m_s, 3.0);
  input.start.p_WB = input.target.center_W;
  EXPECT_DOUBLE_EQ(tighten(Profile{}, input).speed_limit_m_s, 0.5);
}

TEST(RaceGuidance, WhatIsNeededAtTheCrossingIsRadiusMarginAndWhatTighteningAdds) {
  PlanInput input = before_gate(3.0);
  const QuadrotorModel model;
  const Profile profile;
  EXPECT_NEAR(guidance().context(input).crossing_need_m, model.collision_radius_m + profile.crossing_margin_m, 1e-6);
  input.field_age_s = 50.0;
  EXPECT_NEAR(guidance().context(input).crossing_need_m, model.collision_radius_m + profile.crossing_margin_m + 0.1,
              1e-6);
}

TEST(RaceGuidance, WhatBelongsToTheGateGoesWithItsSizeAndTheMarginStaysTheVehicles) {
  PlanInput input = before_gate(3.0);
  const QuadrotorModel model;
  const Profile profile;
  input.target.shape = {.inner_half_m = 1.0, .outer_half_m = 1.5};
  const PlanContext large = guidance().context(input);
  EXPECT_FLOAT_EQ(large.target_size, 2.0f);
  EXPECT_NEAR(large.target.distance_m, 2.0 * profile.funnel_distance_m, 1e-6);
  EXPECT_NEAR(large.crossing_need_m, model.collision_radius_m + profile.crossing_margin_m, 1e-6);
  input.target.shape = {.inner_half_m = model.collision_radius_m + 0.04, .outer_half_m = 0.3};
  EXPECT_NEAR(guidance().context(input).crossing_need_m, model.collision_radius_m + 0.4 * 0.04, 1e-6)
      << "a way through is left";
}

TEST(RaceGuidance, TheSideOfTheDetourIsTheVehiclesAndIsKeptNearTheMiddle) {
  RaceGuidance race = guidance();
  const auto side = [&](double y_m) {
    PlanInput input = before_gate(-1.0);
    input.start.p_WB.y() = y_m;
    return race.context(input).target.by;
  };
  const float left = side(1.0);
  EXPECT_GT(left, 0.5f);
  EXPECT_EQ(side(-0.3), left) << "too near to the middle to change one's mind";
  EXPECT_EQ(side(-0.5), -left);
  EXPECT_EQ(side(0.3), -left);
}

TEST(RaceGuidance, TheGatePassedLastCountsWhileItIsNear) {
  PlanInput input = before_gate(6.0);
  input.passed_gate.center_W = {2, 0, 1.5};
  EXPECT_FALSE(guidance().context(input).has_passed_gate);
  input.has_passed_gate = true;
  EXPECT_TRUE(guidance().context(input).has_passed_gate);
  input.start.p_WB.x() = 5.1;
  EXPECT_FALSE(guidance().context(input).has_passed_gate);
}

TEST(RaceGuidance, TheClearanceAtTheStartIsTheFieldsOrTheDistanceFromTheAxis) {
  PlanInput input = before_gate(2.0);
  input.start.p_WB.y() = 0.2;
  const float without = guidance().context(input).start_clearance_m;
  EXPECT_NEAR(without, GateShape{}.inner_half_m - 0.2, 1e-6);
  const test::AnalyticField field(test::upright_gate({10, 0, 1.5}, 0));
  input.target.field = &field;
  EXPECT_NEAR(guidance().context(input).start_clearance_m, without, 1e-3) << "a perfect field says the same";
}

TEST(RaceGuidance, EveryGateHasTheMeasuresOfItsOwnShape) {
  PlanInput input = before_gate(2.0);
  input.target.shape = {.inner_half_m = 0.3, .outer_half_m = 0.4, .thickness_m = 0.02};
  input.next.center_W = {18, 0, 1.5};
  input.next.shape = {.inner_half_m = 1.5, .outer_half_m = 2.5, .thickness_m = 0.5};
  input.has_next = true;
  input.passed_gate.center_W = {6, 0, 1.5};
  input.passed_gate.shape = {.inner_half_m = 0.75, .outer_half_m = 1.35, .thickness_m = 0.26};
  input.has_passed_gate = true;
  const QuadrotorModel model;
  const PlanContext context = guidance().context(input);
  EXPECT_FLOAT_EQ(context.frame.inner_half_m, 0.3f);
  EXPECT_FLOAT_EQ(context.frame.width_m, 0.1f);
  EXPECT_FLOAT_EQ(context.frame.slab_half_m, static_cast<float>(0.01 + model.collision_radius_m));
  EXPECT_FLOAT_EQ(context.start_clearance_m, 0.3f);
  EXPECT_FLOAT_EQ(context.passed_frame.inner_half_m, 0.75f);
  EXPECT_FLOAT_EQ(context.passed_frame.width_m, 0.6f);
  EXPECT_FLOAT_EQ(context.passed_frame.slab_half_m, static_cast<float>(0.13 + model.collision_radius_m));
  // The way around a frame is as wide as the frame.
  EXPECT_FLOAT_EQ(std::abs(context.next.by) - std::abs(context.target.by), 2.5f - 0.4f);
}

TEST(RaceGuidance, HeightsCountFromTheFloorOrFromTheLowestGate) {
  const Profile profile;
  const auto heights = [&](const Course& course) {
    RaceGuidance race(profile, QuadrotorModel{}, course, kGuideConeAngle_rad);
    const PlanContext context = race.context(before_gate(3.0));
    return std::pair(context.lowest_m, context.highest_m);
  };
  EXPECT_EQ(heights(course_at(1.5, 0.0)), std::pair(0.4f, 120.0f));
  EXPECT_EQ(heights(course_at(-0.5, -2.0)), std::pair(-1.6f, 118.0f));
  EXPECT_EQ(heights(course_at(50.0)), std::pair(48.9f, 168.5f));
}

TEST(RaceGuidance, TheVehiclesBodyRatesArePassedOn) {
  QuadrotorModel model;
  model.body_rate_max_rad_s = {0, 6, 3};
  EXPECT_EQ(guidance({}, model).context(before_gate(3.0)).body_rate_limit_rad_s, Eigen::Vector3f(0, 6, 3));
}

TEST(RaceGuidance, TheSameGateNextTheSameWayIsReachedAroundItsFrame) {
  PlanInput input = before_gate(3.0);
  input.next = input.target;
  input.has_next = true;
  const PlanContext context = guidance().context(input);
  const auto V = [&](float x, float y) { return context.next.potential(10 + x, y, 1.5f); };
  EXPECT_NEAR(V(0.05f, 0), V(0.2f, 0), 0.05f) << "no step behind the opening";
  EXPECT_LT(V(0.5f, context.next.by), V(0.5f, 0)) << "past the frame";
  EXPECT_GT(context.next_from_m, 0.0f);

  input.next.axis_W = -input.next.axis_W;  // back through it: the way is as short as it looks
  EXPECT_EQ(guidance().context(input).next_from_m, 0.0f);
  input.next = input.target;
  input.next.center_W.x() += 8.0;
  EXPECT_EQ(guidance().context(input).next_from_m, 0.0f) << "another gate";
}

TEST(RaceGuidance, AGateThatWasJustPassedAndIsTheTargetAgainBarsTheWayBackOnlyWhileItIsAhead) {
  PlanInput input = before_gate(-1.0);
  input.passed_gate = input.target;
  input.has_passed_gate = true;
  PlanContext behind = guidance().context(input);
  EXPECT_TRUE(behind.has_passed_gate) << "behind it: not back through the opening";
  EXPECT_GT(behind.target.potential(10.1f, 0, 1.5f), behind.target.potential(10.1f, behind.target.by, 1.5f));

  input.start.p_WB.x() = 8.0;
  EXPECT_FALSE(guidance().context(input).has_passed_gate) << "in front of it: a gate like any other";

  input.start.p_WB.x() = 11.0;
  input.target.axis_W = -input.target.axis_W;
  EXPECT_FALSE(guidance().context(input).has_passed_gate) << "the other way: through it";
}

TEST(RaceGuidance, HoldingHasNoFunnel) {
  PlanInput input = before_gate(3.0);
  EXPECT_TRUE(guidance().context(input).target.funnel);
  input.hold = true;
  EXPECT_FALSE(guidance().context(input).target.funnel);
}

}  // namespace
}  // namespace gatefield::planner
