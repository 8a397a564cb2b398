#include <gtest/gtest.h>

#include "server/planner/planner.h"

namespace gatefield::planner {
namespace {

Course gates_at(double first_m, double second_m, std::optional<double> floor_m = {}) {
  Course course;
  course.waypoints = {{{8, 0, first_m}, {1, 0, 0}}, {{16, 0, second_m}, {1, 0, 0}}};
  course.floor_z_m = floor_m;
  return course;
}

Status check(const Course& course, const Profile& profile = {}) {
  return check_heights(profile, QuadrotorModel{}, course);
}

TEST(Heights, CountFromTheFloorWhereTheCourseTellsIt) {
  EXPECT_TRUE(check(gates_at(-0.5, -0.5, -2.0)).ok());
  EXPECT_TRUE(check(gates_at(50, 50, -2.0)).ok());
  EXPECT_TRUE(check(gates_at(4.1, -55.8, -58.0)).ok());
}

TEST(Heights, CountFromTheLowestGateElse) {
  EXPECT_TRUE(check(gates_at(-500, -480)).ok());
  EXPECT_TRUE(check(gates_at(1200, 1210)).ok());
}

TEST(Heights, AGateIsReachableWhileTheVehicleFitsThroughItsOpeningAtAPermittedHeight) {
  // 0.5 - 0.13 m of the opening are the vehicle's, above and below the centre; 0.4 to 120 m are permitted.
  EXPECT_TRUE(check(gates_at(0.04, 1.5, 0.0)).ok());
  EXPECT_FALSE(check(gates_at(0.02, 1.5, 0.0)).ok());
  EXPECT_TRUE(check(gates_at(1.5, 120.36, 0.0)).ok());
  EXPECT_FALSE(check(gates_at(1.5, 120.38, 0.0)).ok());
}

TEST(Heights, AGateOutOfReachIsRefusedByItsField) {
  const auto planner = Planner::create(Profile{}, QuadrotorModel{}, gates_at(1.5, 200, 0.0), kGuideConeAngle_rad, 1);
  ASSERT_FALSE(planner.ok());
  EXPECT_EQ(planner.failure().field, "course.waypoints[1].p_W");
  EXPECT_NE(planner.error().find("profile race permits above the floor"), std::string::npos) << planner.error();
  const auto below = Planner::create(Profile{}, QuadrotorModel{}, gates_at(0.01, 1.5, 0.0), kGuideConeAngle_rad, 1);
  ASSERT_FALSE(below.ok());
  EXPECT_EQ(below.failure().field, "course.waypoints[0].p_W");
}

TEST(Heights, AProfileWithoutTheirWeightPermitsAll) {
  Profile profile;
  profile.altitude_weight = 0.0;
  EXPECT_TRUE(check(gates_at(1.5, 200, 0.0), profile).ok());
}

}  // namespace
}  // namespace gatefield::planner
