#include "server/planner/race_guidance.h"

#include <gtest/gtest.h>

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

RaceGuidance guidance(const Profile& profile = {}) {
  return RaceGuidance(profile, QuadrotorModel{}, GateShape{}, kGuideConeAngle_rad);
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

TEST(RaceGuidance, HoldingHasNoFunnel) {
  PlanInput input = before_gate(3.0);
  EXPECT_TRUE(guidance().context(input).target.funnel);
  input.hold = true;
  EXPECT_FALSE(guidance().context(input).target.funnel);
}

}  // namespace
}  // namespace gatefield::planner
