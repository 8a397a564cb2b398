#include "client/sdk/keep_clear.h"

#include <gtest/gtest.h>

namespace gatefield::sdk {
namespace {

constexpr double kMargin_m = 0.5;

/// One gate at (10, 0, 1.5), flown through along x: inner half 0.5 m, outer 0.75 m.
Course one_gate() {
  Course course;
  course.waypoints.emplace_back(Eigen::Vector3d(10, 0, 1.5), Eigen::Vector3d(1, 0, 0));
  course.closed = false;
  return course;
}

TEST(KeepClear, DriftsOutOfTheGateAlongItsAxis) {
  const KeepClear clear(one_gate(), kMargin_m);
  const Eigen::Vector2d behind = clear.drift({10.1, 0.3, 1.5}, false), before = clear.drift({9.9, -0.3, 1.5}, false);
  EXPECT_GT(behind.x(), 0.5);
  EXPECT_LT(before.x(), -0.5);
  EXPECT_NEAR(behind.y(), 0, 1e-12);
  EXPECT_LE(behind.norm(), KeepClear::kDrift_m_s);
}

TEST(KeepClear, LeavesAloneWhoIsClear) {
  const KeepClear clear(one_gate(), kMargin_m);
  EXPECT_EQ(clear.drift({11.1, 0, 1.5}, false).norm(), 0) << "along the axis";
  EXPECT_EQ(clear.drift({10, 1.3, 1.5}, false).norm(), 0) << "beside";
  EXPECT_EQ(clear.drift({10, 0, 2.8}, false).norm(), 0) << "above, hovering";
  EXPECT_EQ(clear.drift({10, 0, 0.2}, true).norm(), 0) << "below";
}

TEST(KeepClear, NothingSinksOntoAGate) {
  const KeepClear clear(one_gate(), kMargin_m);
  EXPECT_GT(clear.drift({10.1, 0, 8}, true).norm(), 0.5);
}

TEST(KeepClear, AGateWithSeveralPassagesIsOne) {
  Course course = one_gate();
  course.waypoints[0].gate_id = 7;
  course.waypoints.push_back(course.waypoints[0]);
  course.waypoints[1].direction_W *= -1;
  const KeepClear once(one_gate(), kMargin_m), twice(course, kMargin_m);
  EXPECT_EQ(once.drift({10.2, 0.1, 1.5}, false), twice.drift({10.2, 0.1, 1.5}, false));
}

TEST(KeepClear, SteersIntoTheOpeningOrAroundTheGateWhicheverIsNearer) {
  const KeepClear clear(one_gate(), 0.3);
  const Eigen::Vector3d v_W(6, 0, 0);
  EXPECT_EQ(clear.steer({6, 0, 1.5}, v_W).norm(), 0) << "through the middle";
  EXPECT_LT(clear.steer({6, 0.5, 1.5}, v_W).y(), -0.2) << "into the left inner edge: back to the middle";
  EXPECT_GT(clear.steer({6, -0.5, 1.5}, v_W).y(), 0.2);
  EXPECT_GT(clear.steer({6, 0.8, 1.5}, v_W).y(), 0.2) << "into the left outer edge: around";
  EXPECT_LT(clear.steer({6, -0.8, 1.5}, v_W).y(), -0.2);
  EXPECT_EQ(clear.steer({6, 1.2, 1.5}, v_W).norm(), 0) << "past it";
  EXPECT_GT(clear.steer({6, 0.3, 2.2}, v_W).y(), 0.2) << "into the upper bar: around, not through";
  EXPECT_EQ(clear.steer({6, 0.0, 3}, v_W).norm(), 0) << "over it";
}

TEST(KeepClear, SteersForWhatLiesAheadOnly) {
  const KeepClear clear(one_gate(), 0.3);
  EXPECT_EQ(clear.steer({11, 0.5, 1.5}, {6, 0, 0}).norm(), 0) << "behind";
  EXPECT_EQ(clear.steer({0, 0.5, 1.5}, {6, 0, 0}).norm(), 0) << "far ahead";
  EXPECT_EQ(clear.steer({6, 0.5, 1.5}, {0, 0, 0}).norm(), 0) << "at rest";
  EXPECT_LE(clear.steer({9.9, 0.5, 1.5}, {6, 0, 0}).norm(), KeepClear::kMaxSteer_m_s2);
}

TEST(KeepClear, KnowsWhatIsPassedWithinATime) {
  const KeepClear clear(one_gate(), 0.3);
  const Eigen::Vector3d ahead(7, 0, 0);
  EXPECT_TRUE(clear.passes({8, 0, 1.5}, ahead, 0.3)) << "2 m before it";
  EXPECT_FALSE(clear.passes({8, 0, 1.5}, ahead, 0.25));
  EXPECT_TRUE(clear.passes({8, 0.9, 1.5}, ahead, 0.3)) << "its frame";
  EXPECT_FALSE(clear.passes({8, 1.2, 1.5}, ahead, 0.3)) << "beside it";
  EXPECT_FALSE(clear.passes({8, 0, 3.0}, ahead, 0.3)) << "above it";
  EXPECT_FALSE(clear.passes({10.5, 0, 1.5}, ahead, 1.0)) << "behind it";
  EXPECT_TRUE(clear.passes({10.2, 0, 1.5}, ahead, 0.0)) << "in it";
  EXPECT_TRUE(clear.passes({12, 0, 1.5}, -ahead, 0.3)) << "from the other side";
  EXPECT_FALSE(clear.passes({8, 0, 1.5}, Eigen::Vector3d::Zero(), 1.0)) << "who hovers passes nothing";
}

}  // namespace
}  // namespace gatefield::sdk
