#include "common/course/course.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace gatefield {
namespace {

using testing::HasSubstr;

Course there_and_back() {
  Course course;
  course.waypoints = {{{0, 0, 1.5}, {1, 0, 0}, {}, 1}, {{4, 0, 2.5}, {0, 1, 0}}, {{0, 0, 1.5}, {-1, 0, 0}, {}, 1}};
  return course;
}

Error refusal_of(const std::function<void(Course*)>& spoil) {
  Course course = there_and_back();
  spoil(&course);
  const Status status = validate(course);
  EXPECT_FALSE(status.ok());
  return status.ok() ? Error("accepted") : status.failure();
}

TEST(PassingDirection, IsTheWaypointsOwnWhereItHasOne) {
  Course course = there_and_back();
  course.waypoints[1].direction_W = {0, 3, 0};
  EXPECT_TRUE(passing_direction(course, 1).isApprox(Eigen::Vector3d::UnitY()));
}

TEST(PassingDirection, OfAnOpenCourseComesFromTheNeighboursInThreeDimensions) {
  Course course;
  course.closed = false;
  course.waypoints = {{{0, 0, 1.5}}, {{3, 0, 1.5}}, {{3, 5, 4.5}}};
  EXPECT_TRUE(passing_direction(course, 0).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(passing_direction(course, 1).isApprox(Eigen::Vector3d(3, 5, 3).normalized()));
  EXPECT_TRUE(passing_direction(course, 2).isApprox(Eigen::Vector3d(0, 5, 3).normalized()));
}

TEST(PassingDirection, OfTwoGatesOnAClosedCourseIsTheWayIn) {
  Course course;
  course.waypoints = {{{0, 0, 1}}, {{3, 0, 1}}};
  EXPECT_TRUE(passing_direction(course, 0).isApprox(-Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(passing_direction(course, 1).isApprox(Eigen::Vector3d::UnitX()));
}

TEST(PassingDirection, IsZeroWhenNothingTells) {
  Course course;
  course.waypoints = {{{0, 0, 1}}};
  EXPECT_TRUE(passing_direction(course, 0).isZero());
}

TEST(GatePose, OfAnInclinedGateKeepsItsSidesLevel) {
  const Eigen::Isometry3d X_WG = gate_pose({1, 2, 3}, Eigen::Vector3d(1, 1, 1).normalized());
  EXPECT_NEAR(X_WG.linear().col(1).z(), 0.0, 1e-12);
  EXPECT_GT(X_WG.linear().col(2).z(), 0.0);
  EXPECT_TRUE((X_WG.linear() * X_WG.linear().transpose()).isIdentity(1e-12));
  EXPECT_NEAR(gate_pose({0, 0, 0}, Eigen::Vector3d::UnitZ()).linear().determinant(), 1.0, 1e-12);
}

TEST(PhysicalGates, AreNumberedInTheOrderOfFirstPassage) {
  Course course = there_and_back();
  course.waypoints.push_back({{8, 0, 1.5}, {1, 0, 0}, {}, 9});
  EXPECT_EQ(gate_count(course), 3u);
  EXPECT_EQ(gate_index(course, 0), 0u);
  EXPECT_EQ(gate_index(course, 1), 1u);
  EXPECT_EQ(gate_index(course, 2), 0u);
  EXPECT_EQ(gate_index(course, 3), 2u);
}

TEST(PhysicalGates, WithoutANumberAreNeverTheSame) {
  Course course;
  course.waypoints = {{{0, 0, 1}, {1, 0, 0}}, {{0, 0, 1}, {1, 0, 0}}};
  EXPECT_EQ(gate_count(course), 2u);
  EXPECT_EQ(gate_index(course, 1), 1u);
}

TEST(HeightReference, IsTheFloorOrAStandBelowTheLowestGate) {
  Course course = there_and_back();
  EXPECT_EQ(height_reference_m(course), 0.0);
  for (Waypoint& waypoint : course.waypoints) waypoint.p_W.z() += 50;
  EXPECT_EQ(height_reference_m(course), 50.0);
  course.floor_z_m = 49.0;
  EXPECT_EQ(height_reference_m(course), 49.0);
}

TEST(ValidateCourse, TakesOneGateFlownInBothDirections) {
  const Status status = validate(there_and_back());
  EXPECT_TRUE(status.ok()) << status.error();
}

TEST(ValidateCourse, NamesTheFieldAndWhatWasExpected) {
  const struct {
    const char* what;
    std::function<void(Course*)> spoil;
    const char* field;
    const char* sentence;
  } cases[] = {
      {"no waypoints", [](Course* c) { c->waypoints.clear(); }, "course.waypoints", "is 0 long, expected 1 to 64"},
      {"far", [](Course* c) { c->waypoints[1].p_W.x() = 2e5; }, "course.waypoints[1].p_W", "less than 1e5 m"},
      {"not finite", [](Course* c) { c->waypoints[0].p_W.z() = std::numeric_limits<double>::quiet_NaN(); },
       "course.waypoints[0].p_W", "expected finite"},
      {"length", [](Course* c) { c->waypoints[0].direction_W *= 2; }, "course.waypoints[0].direction_W", "unit vector"},
      {"shape", [](Course* c) { c->waypoints[1].gate.inner_half_m = 0; }, "course.waypoints[1].gate.inner_half_m",
       "0.1 to 5 m"},
      {"laps", [](Course* c) { c->laps = 0; }, "course.laps", "is 0, expected 1 to 1000"},
      {"two places of one gate", [](Course* c) { c->waypoints[2].p_W.y() = 0.5; }, "course.waypoints[2].p_W",
       "which names the same gate (1)"},
      {"two shapes of one gate", [](Course* c) { c->waypoints[2].gate.inner_half_m = 0.6; }, "course.waypoints[2].gate",
       "which names the same gate (1)"},
      {"two axes of one gate",
       [](Course* c) {
         c->waypoints[2].direction_W = {0, 1, 0};
       },
       "course.waypoints[2].direction_W", "within 30 deg of the axis of waypoints[0]"},
      {"floor above a gate", [](Course* c) { c->floor_z_m = 1.6; }, "course.floor_z_m",
       "below the lowest waypoint, 1.5"},
  };
  for (const auto& c : cases) {
    const Error error = refusal_of(c.spoil);
    EXPECT_EQ(error.field, c.field) << c.what;
    EXPECT_EQ(error.code, ErrorCode::kInvalid) << c.what;
    EXPECT_THAT(error.message, HasSubstr(c.sentence)) << c.what;
  }
}

TEST(ValidateCourse, RefusesAGateWhosePassingDirectionNothingTells) {
  Course course;
  course.waypoints = {{{0, 0, 1.5}}};
  const Status status = validate(course);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().field, "course.waypoints[0].direction_W");
}

}  // namespace
}  // namespace gatefield
