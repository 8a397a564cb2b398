#include <gtest/gtest.h>

#include "server/planner/costs/altitude.h"
#include "server/planner/costs/body_rate.h"
#include "server/planner/costs/crossing.h"
#include "server/planner/costs/field_clearance.h"
#include "server/planner/costs/passed_frame.h"
#include "server/planner/costs/progress.h"
#include "server/planner/costs/speed.h"
#include "server/planner/costs/visibility.h"
#include "tests/unit/server/planner/batch_fixture.h"

namespace gatefield::planner {
namespace {

using test::BatchFixture;
using test::context_at_origin;

TEST(ProgressCost, SquaredDistanceTelescopesAsPrinted) {
  Profile profile;
  profile.progress_metric = ProgressMetric::kSquaredDistance;
  profile.progress_weight = 2.0;
  BatchFixture fixture(3, 2);
  fixture.place(0, 0, {-2.5f, 0.4f, 0});
  fixture.place(1, 0, {-2.0f, 0.8f, 0});
  fixture.place(2, 0, {-1.0f, 1.0f, 0});
  const auto cost = fixture.cost_of(ProgressCost(profile), context_at_origin());
  // sum_k (|p_{k+1}|^2 - |p_k|^2) = |p_3|^2 - |p_0|^2 = 2 - 9
  EXPECT_NEAR(cost[0], 2.0f * (2.0f - 9.0f), 1e-4f);
}

TEST(ProgressCost, DistanceRewardsEveryMetreAlike) {
  Profile profile;
  profile.progress_weight = 1.0;
  BatchFixture fixture(1, 2);
  fixture.place(0, 0, {-2, 0, 0});
  fixture.place(0, 1, {-1, 0, 0});
  const auto cost = fixture.cost_of(ProgressCost(profile), context_at_origin());
  EXPECT_NEAR(cost[0], -1.0f, 1e-5f);
  EXPECT_NEAR(cost[1], -2.0f, 1e-5f);
}

TEST(ProgressCost, BeyondTheOpeningTheNextGateCounts) {
  Profile profile;
  profile.progress_weight = 1.0;
  BatchFixture fixture(1, 2);
  fixture.place(0, 0, {1, 0, 0});
  fixture.place(0, 1, {1, 1, 0});
  fixture.through(0, 0) = 1;
  fixture.through(0, 1) = 1;
  const auto cost = fixture.cost_of(ProgressCost(profile), context_at_origin());
  EXPECT_LT(cost[0], -3.0f);    // more than reaching the gate is worth
  EXPECT_LT(cost[1], cost[0]);  // and more still when heading for the next one
}

TEST(ProgressCost, LeavingTheOpeningIsWorthItThoughTheNextGateLiesBehind) {
  Profile profile;
  profile.progress_weight = 1.0;
  PlanContext context = context_at_origin();
  context.next = make_guidance({-1, 6, 0}, {0, 1, 0}, false, 0.7, 1.5, 0.75, 1.0);
  BatchFixture fixture(1, 3);
  const float x[] = {-0.1f, 0.1f, 0.4f};
  for (int m = 0; m < 3; ++m) {
    fixture.place(0, m, {x[m], 0, 0});
    fixture.through(0, m) = m > 0 ? 1 : 0;
  }
  const auto cost = fixture.cost_of(ProgressCost(profile), context);
  EXPECT_LT(cost[1], cost[0] - 0.1f);
  EXPECT_LT(cost[2], cost[1] - 0.1f);
}

TEST(ProgressCost, PassingTheOpeningCostsNothingWhereTheNextGateIsTheSameOne) {
  Profile profile;
  profile.progress_weight = 1.0;
  PlanContext context = context_at_origin(true);
  context.next = context.target;
  context.next.beyond_m = 0.0f;
  context.next_from_m = 0.01f;
  BatchFixture fixture(1, 4);
  const float x[] = {-0.1f, 0.1f, 0.4f, 0.4f}, y[] = {0, 0, 0, -1.0f};
  for (int m = 0; m < 4; ++m) {
    fixture.place(0, m, {x[m], y[m], 0});
    fixture.through(0, m) = m > 0 ? 1 : 0;
  }
  const auto cost = fixture.cost_of(ProgressCost(profile), context);
  EXPECT_LT(cost[1], cost[0] - 0.1f);
  EXPECT_LT(cost[2], cost[1] - 0.1f);
  EXPECT_LT(cost[3], cost[2] - 0.1f) << "and on around the frame";
}

TEST(ProgressCost, FlyingPastTheGateIsNoProgress) {
  Profile profile;
  profile.progress_weight = 1.0;
  BatchFixture fixture(1, 2);
  fixture.place(0, 0, {1, 1.5f, 0});  // beyond the plane, outside, not through
  fixture.place(0, 1, {-0.1f, 0, 0});
  const auto cost = fixture.cost_of(ProgressCost(profile), context_at_origin(true));
  EXPECT_GT(cost[0], cost[1] + 1.0f);
}

TEST(VisibilityCost, OneMinusCosineOfTheBearing) {
  Profile profile;
  profile.visibility_weight = 3.0;
  BatchFixture fixture(1, 3);
  for (int m = 0; m < 3; ++m) {
    fixture.place(0, m, {-3, 0, 0});
    fixture.along(0, m) = -3;
  }
  const float half = 0.5f * 1.5707963f;
  fixture.at(0, kernels::kQw, 1) = std::cos(half);  // yaw 90 deg
  fixture.at(0, kernels::kQz, 1) = std::sin(half);
  fixture.at(0, kernels::kQw, 2) = 0;  // yaw 180 deg
  fixture.at(0, kernels::kQz, 2) = 1;
  const auto cost = fixture.cost_of(VisibilityCost(profile), context_at_origin());
  EXPECT_NEAR(cost[0], 0.0f, 1e-4f);
  EXPECT_NEAR(cost[1], 3.0f, 1e-4f);
  EXPECT_NEAR(cost[2], 6.0f, 1e-4f);
}

TEST(VisibilityCost, NearTheOpeningTheNextGateIsLookedAt) {
  Profile profile;
  profile.visibility_weight = 1.0;
  profile.look_ahead_m = 1.0;
  BatchFixture fixture(1, 2);
  fixture.place(0, 0, {-0.5f, 0, 0});
  fixture.along(0, 0) = -0.5f;
  const float yaw = std::atan2(6.0f, 6.5f);
  fixture.at(0, kernels::kQw, 0) = std::cos(0.5f * yaw);
  fixture.at(0, kernels::kQz, 0) = std::sin(0.5f * yaw);
  EXPECT_NEAR(fixture.cost_of(VisibilityCost(profile), context_at_origin())[0], 0.0f, 1e-4f);
}

TEST(FieldClearanceCost, HingeOnTheClearanceAndBoundedBelow) {
  Profile profile;
  profile.field_weight = 2.0;
  profile.field_clearance_m = 1.0;
  BatchFixture fixture(2, 3);
  fixture.field(0, 0) = 1.5f;
  fixture.field(1, 0) = 0.25f;
  fixture.field(0, 1) = -100.0f;
  fixture.field(1, 1) = 1.0f;
  fixture.field(0, 2) = 2.0f;
  fixture.field(1, 2) = 2.0f;
  const auto cost = fixture.cost_of(FieldClearanceCost(profile), context_at_origin());
  EXPECT_NEAR(cost[0], 2.0f * 0.75f, 1e-5f);
  EXPECT_NEAR(cost[1], 2.0f * 3.0f, 1e-5f);
  EXPECT_EQ(cost[2], 0.0f);
}

TEST(FieldClearanceCost, CountsInGatesOfTheUsualSize) {
  Profile profile;
  profile.field_weight = 1.0;
  profile.field_clearance_m = 1.0;
  BatchFixture fixture(1, 2);
  fixture.field(0, 0) = 1.0f;  // the middle of an opening of 2 m
  fixture.field(0, 1) = 1.0f;
  fixture.next_field(0, 0) = fixture.next_field(0, 1) = 0.2f;  // of one of 0.4 m
  fixture.through(0, 1) = 1;
  PlanContext context = context_at_origin();
  context.target_size = 2.0f;
  context.next_size = 0.4f;
  const auto cost = fixture.cost_of(FieldClearanceCost(profile), context);
  EXPECT_NEAR(cost[0], 0.5f, 1e-6f);
  EXPECT_NEAR(cost[1], 0.5f, 1e-6f);
}

TEST(FieldClearanceCost, BeyondTheOpeningTheNextFieldOrNone) {
  Profile profile;
  profile.field_weight = 1.0;
  profile.field_clearance_m = 1.0;
  BatchFixture fixture(1, 1);
  fixture.field(0, 0) = -1.0f;
  fixture.through(0, 0) = 1;
  EXPECT_EQ(fixture.cost_of(FieldClearanceCost(profile), context_at_origin())[0], 0.0f);
  fixture.next_field(0, 0) = 0.4f;
  EXPECT_NEAR(fixture.cost_of(FieldClearanceCost(profile), context_at_origin())[0], 0.6f, 1e-5f);
}

TEST(FieldClearanceCost, NoFieldNoCost) {
  BatchFixture fixture(2, 1);
  EXPECT_EQ(fixture.cost_of(FieldClearanceCost(Profile{}), context_at_origin())[0], 0.0f);
}

TEST(CrossingCost, GrowsWithWhatIsLackingAndSaturates) {
  Profile profile;
  profile.crossing_weight = 10.0;
  BatchFixture fixture(1, 4);
  fixture.crossing(1) = 0.30f;  // enough
  fixture.crossing(2) = 0.11f;  // 0.1 m lacking
  fixture.crossing(3) = -5.0f;
  const auto cost = fixture.cost_of(CrossingCost(profile), context_at_origin());
  EXPECT_EQ(cost[0], 0.0f);
  EXPECT_EQ(cost[1], 0.0f);
  EXPECT_NEAR(cost[2], 10.0f * 1.4f, 1e-4f);
  EXPECT_NEAR(cost[3], 50.0f, 1e-4f);
}

TEST(PassedFrameCost, ThePostOfTheGatePassedLastIsSolid) {
  const PassedFrameCost term(Profile{});
  PlanContext context = context_at_origin();
  context.passed_gate = make_guidance({0, 0, 0}, {1, 0, 0}, true, 0.7, 1.5, 0.75, 1.0);
  BatchFixture fixture(3, 5);
  // In the opening, in the post, behind the post, far outside; and back through the opening.
  const float x[] = {0.05f, 0.05f, 0.4f, 0.05f, -0.2f}, y[] = {0.1f, 0.6f, 0.6f, 2.0f, 0.1f};
  for (int m = 0; m < 5; ++m) {
    for (int k = 0; k < 3; ++k) fixture.place(k, m, {3, y[m], 0});
    fixture.place(1, m, {x[m], y[m], 0});
  }
  EXPECT_EQ(fixture.cost_of(term, context)[1], 0.0f);  // no gate was passed
  context.has_passed_gate = true;
  const auto cost = fixture.cost_of(term, context);
  EXPECT_EQ(cost[0], 0.0f);
  EXPECT_NEAR(cost[1], 100.0f * (1.0f + 4.0f * 0.31f), 0.1f);
  EXPECT_EQ(cost[2], 0.0f);
  EXPECT_EQ(cost[3], 0.0f);
  EXPECT_NEAR(cost[4], 100.0f * (1.0f + 4.0f * 0.21f), 0.1f);

  // Of a wider gate the same post stands elsewhere, whatever the target's size.
  context.passed_frame = {.inner_half_m = 1.0f, .width_m = 0.25f, .slab_half_m = 0.16f};
  EXPECT_EQ(fixture.cost_of(term, context)[1], 0.0f);
}

TEST(SpeedCost, SquareOfTheExcess) {
  Profile profile;
  profile.speed_weight = 2.0;
  BatchFixture fixture(1, 2);
  fixture.at(0, kernels::kVx, 0) = 6.0f;
  fixture.at(0, kernels::kVy, 0) = 8.0f;
  fixture.at(0, kernels::kVx, 1) = 6.9f;
  const auto cost = fixture.cost_of(SpeedCost(profile), context_at_origin());
  EXPECT_NEAR(cost[0], 2.0f * 9.0f, 1e-4f);
  EXPECT_EQ(cost[1], 0.0f);
}

TEST(BodyRateCost, SquareOfTheExcess) {
  Profile profile;
  profile.body_rate_limit_rad_s = 9;
  BatchFixture fixture(1, 1);
  fixture.at(0, kernels::kWz, 0) = -11.0f;
  EXPECT_NEAR(fixture.cost_of(BodyRateCost(profile), context_at_origin())[0], 4.0f, 1e-4f);
}

TEST(BodyRateCost, AVehiclesLowerLimitAboutAnAxisHoldsBesideTheProfiles) {
  Profile profile;
  profile.body_rate_limit_rad_s = 9;
  PlanContext context = context_at_origin();
  context.body_rate_limit_rad_s = {0, 20, 2};
  BatchFixture fixture(2, 3);
  fixture.at(0, kernels::kWz, 0) = -5.0f;  // beyond the vehicle's, within the profile's
  fixture.at(1, kernels::kWy, 1) = 8.5f;   // within both
  fixture.at(1, kernels::kWx, 2) = 8.5f;   // the vehicle has none
  const auto cost = fixture.cost_of(BodyRateCost(profile), context);
  EXPECT_NEAR(cost[0], 9.0f, 1e-4f);
  EXPECT_EQ(cost[1], 0.0f);
  EXPECT_EQ(cost[2], 0.0f);
  context.body_rate_limit_rad_s.setZero();
  EXPECT_EQ(fixture.cost_of(BodyRateCost(profile), context)[0], 0.0f);
}

TEST(AltitudeCost, MetresOutside) {
  Profile profile;
  profile.altitude_weight = 20;
  PlanContext context = context_at_origin();
  context.lowest_m = -9.5f;
  context.highest_m = -7.0f;
  BatchFixture fixture(2, 2);
  fixture.at(0, kernels::kPz, 0) = -9.8f;
  fixture.at(1, kernels::kPz, 0) = -6.5f;
  for (int k = 0; k < 2; ++k) fixture.at(k, kernels::kPz, 1) = -8.0f;
  const auto cost = fixture.cost_of(AltitudeCost(profile), context);
  EXPECT_NEAR(cost[0], 20.0f * 0.8f, 1e-4f);
  EXPECT_EQ(cost[1], 0.0f);
}

TEST(Terms, OnlyThoseWithWeightAreThere) {
  Profile profile;
  EXPECT_EQ(make_terms(profile).size(), 8u);
  profile.crossing_weight = 0;
  profile.body_rate_weight = 0;
  for (const auto& term : make_terms(profile)) {
    EXPECT_NE(term->name(), "crossing");
    EXPECT_NE(term->name(), "body_rate");
  }
}

}  // namespace
}  // namespace gatefield::planner
