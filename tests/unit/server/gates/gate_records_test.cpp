#include "server/gates/gate_records.h"

#include <gtest/gtest.h>

#include "tests/support/analytic_field.h"

namespace gatefield::gates {
namespace {

using namespace std::chrono_literals;

/// There and back through gate 7, another gate between.
Course out_and_back() {
  Course course;
  course.waypoints.push_back({{5, 0, 1.5}, Eigen::Vector3d::UnitX(), {}, 7});
  course.waypoints.push_back({{10, 3, 1.5}, Eigen::Vector3d::UnitY(), {}, 0});
  course.waypoints.push_back({{5, 0, 1.5}, -Eigen::Vector3d::UnitX(), {}, 7});
  return course;
}

GateMeasurement measured(const Eigen::Vector3d& center_W, double yaw_rad) {
  return {test::upright_gate(center_W, yaw_rad), 0.05, 0.05};
}

TEST(GateRecords, AreTheCourseUntilAGateIsSeen) {
  GateRecords records(out_and_back());
  EXPECT_FALSE(records.seen(0));
  EXPECT_EQ(records.expectation(1).center_W, Eigen::Vector3d(10, 3, 1.5));
  EXPECT_EQ(records.expectation(1).axis_W, Eigen::Vector3d::UnitY());
  EXPECT_EQ(records.expectation(2).axis_W, Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(records.records().size(), 2u);
}

TEST(GateRecords, OneGatePassedEitherWayHasOneMemory) {
  for (const std::uint32_t looked_for : {0u, 2u}) {
    GateRecords records(out_and_back());
    GateMeasurement measurement = measured({5.3, 0.2, 1.5}, 0.2);
    ASSERT_TRUE(records.take(looked_for, &measurement, 1s));
    EXPECT_TRUE(records.seen(0));
    EXPECT_TRUE(records.seen(2));
    EXPECT_FALSE(records.seen(1));
    EXPECT_EQ(records.expectation(0).gate, records.expectation(2).gate);
    EXPECT_EQ(records.expectation(2).center_W, records.expectation(0).center_W);
    EXPECT_EQ(records.expectation(2).axis_W, Eigen::Vector3d(-records.expectation(0).axis_W));
    EXPECT_NEAR(records.expectation(0).axis_W.y(), std::sin(0.2), 1e-12) << "waypoint " << looked_for;
    EXPECT_GT(records.expectation(0).axis_W.x(), 0.9) << "waypoint " << looked_for;
  }
}

TEST(GateRecords, SightsFromBothSidesAverage) {
  GateRecords records(out_and_back());
  for (int i = 0; i < 10; ++i) {
    GateMeasurement front = measured({5.1, 0, 1.5}, 0.1), back = measured({5.1, 0, 1.5}, 0.1 + 3.14159265358979);
    ASSERT_TRUE(records.take(0, &front, i * 20ms));
    ASSERT_TRUE(records.take(2, &back, i * 20ms + 10ms));
  }
  EXPECT_NEAR(std::atan2(records.expectation(0).axis_W.y(), records.expectation(0).axis_W.x()), 0.1, 1e-9);
}

TEST(GateRecords, TheFieldIsSharedWithSnapshotsAndNotCopied) {
  GateRecords records(out_and_back());
  GateMeasurement measurement = measured({5, 0, 1.5}, 0);
  ASSERT_TRUE(records.take(0, &measurement, 1s));
  const auto field = std::make_shared<test::AnalyticField>(measurement.X_WG);
  records.set_field(0, field);
  Snapshot snapshot;
  records.snapshot(0, 1, &snapshot);
  EXPECT_EQ(snapshot.gates[0].field, field);
  EXPECT_EQ(snapshot.gates[0].stamp, 1s);
  EXPECT_FALSE(snapshot.gates[1].seen);
}

TEST(GateRecords, HowFarFromItsWaypointAGateMayBeGoesWithItsSize) {
  for (const double size : {0.3, 2.0}) {
    Course course = out_and_back();
    for (Waypoint& waypoint : course.waypoints) waypoint.gate.inner_half_m *= size;
    GateRecords records(course);
    GateMeasurement far = measured({5 + 1.95 * size, 0, 1.5}, 0), near = measured({5 + 1.85 * size, 0, 1.5}, 0);
    EXPECT_FALSE(records.take(0, &far, 1s)) << size;
    EXPECT_TRUE(records.take(0, &near, 1s)) << size;
  }
}

TEST(GateRecords, AGateFarFromItsWaypointIsAnotherGate) {
  GateRecords records(out_and_back());
  GateMeasurement measurement = measured({7.0, 0, 1.5}, 0);
  EXPECT_FALSE(records.take(0, &measurement, 1s));
  EXPECT_FALSE(records.seen(0));
}

}  // namespace
}  // namespace gatefield::gates
