#include "server/gates/known_gates.h"

#include <gtest/gtest.h>

namespace gatefield::gates {
namespace {

using namespace std::chrono_literals;

class KnownGatesTest : public ::testing::Test {
 protected:
  KnownGatesTest() {
    snapshot_.waypoint = {0, 1};
    snapshot_.gates[0].seen = true;
    snapshot_.gates[0].stamp = 2s;
    snapshot_.gates[0].center_W = {5.2, 0, 1.5};
    snapshot_.gates[0].axis_W = {0, 1, 0};
  }
  static Course course() {  // gate 3, another one, gate 3 the other way
    Course course;
    course.waypoints.push_back({{5, 0, 1.5}, Eigen::Vector3d::UnitX(), {}, 3});
    course.waypoints.push_back({{10, 0, 1.5}, Eigen::Vector3d::UnitY(), {}, 0});
    course.waypoints.push_back({{5, 0, 1.5}, -Eigen::Vector3d::UnitX(), {}, 3});
    course.waypoints[1].gate.inner_half_m = 0.6;
    return course;
  }
  Passages passages_{course()};
  KnownGates gates_{&passages_};
  Snapshot snapshot_;
};

TEST_F(KnownGatesTest, AreTheCourseBeforeTheFirstSnapshot) {
  EXPECT_FALSE(gates_.belief(0).seen);
  EXPECT_EQ(gates_.belief(0).center_W, Eigen::Vector3d(5, 0, 1.5));
  EXPECT_EQ(gates_.belief(1).shape.inner_half_m, 0.6);
  EXPECT_EQ(gates_.age_s(0, 3s), -1.0);
}

TEST_F(KnownGatesTest, KnowWhatTheSnapshotHasSeen) {
  gates_.take(&snapshot_);
  EXPECT_TRUE(gates_.belief(0).seen);
  EXPECT_EQ(gates_.belief(0).center_W, Eigen::Vector3d(5.2, 0, 1.5));
  EXPECT_EQ(gates_.age_s(0, 3s), 1.0);
  EXPECT_FALSE(gates_.belief(1).seen);
}

TEST_F(KnownGatesTest, AWaypointKnowsItsGateFromAnEarlierPassageAndTurnsItsAxis) {
  gates_.take(&snapshot_);
  EXPECT_TRUE(gates_.belief(2).seen);
  EXPECT_EQ(gates_.belief(2).center_W, gates_.belief(0).center_W);
  EXPECT_EQ(gates_.belief(2).axis_W, Eigen::Vector3d(0, -1, 0));
}

}  // namespace
}  // namespace gatefield::gates
