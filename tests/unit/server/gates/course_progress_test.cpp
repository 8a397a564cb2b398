#include "server/gates/course_progress.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace gatefield::gates {
namespace {

Course square_course(int laps) {
  Course course;
  course.laps = laps;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(6, 0, 1.5), Eigen::Vector3d(0, 6, 1.5), Eigen::Vector3d(-6, 0, 1.5),
                                   Eigen::Vector3d(0, -6, 1.5)})
    course.waypoints.push_back({p, Eigen::Vector3d::Zero(), {}});
  return course;
}

TEST(CourseProgress, AxisFollowsFromTheNeighbours) {
  const CourseProgress progress(square_course(1));
  EXPECT_TRUE(progress.nominal(0).axis_W.isApprox(Eigen::Vector3d(0, 1, 0), 1e-9));
  EXPECT_TRUE(progress.nominal(1).axis_W.isApprox(Eigen::Vector3d(-1, 0, 0), 1e-9));
  EXPECT_FALSE(progress.nominal(0).seen);
}

TEST(CourseProgress, AGivenDirectionWins) {
  Course course = square_course(1);
  course.waypoints[2].direction_W = {0, 0, -1};
  EXPECT_TRUE(CourseProgress(course).nominal(2).axis_W.isApprox(Eigen::Vector3d(0, 0, -1), 1e-9));
}

TEST(CourseProgress, ThroughTheOpeningForwardsOnly) {
  CourseProgress progress(square_course(1));
  GateBelief gate = progress.nominal(0);
  gate.seen = true;
  EXPECT_FALSE(progress.update({6, 1, 1.5}, gate));
  EXPECT_FALSE(progress.update({6, -1, 1.5}, gate));  // backwards
  EXPECT_TRUE(progress.update({6, 0.5, 1.5}, gate));
  EXPECT_EQ(progress.target(), 1u);
}

TEST(CourseProgress, BesideTheFrameDoesNotCountOnceSeen) {
  CourseProgress progress(square_course(1));
  GateBelief gate = progress.nominal(0);
  EXPECT_FALSE(progress.update({7.2, -1, 1.5}, gate));
  gate.seen = true;
  EXPECT_FALSE(progress.update({7.2, 1, 1.5}, gate));
  EXPECT_EQ(progress.target(), 0u);
}

TEST(CourseProgress, AnUnseenGateMayBeFarFromItsWaypoint) {
  CourseProgress progress(square_course(1));
  const GateBelief gate = progress.nominal(0);
  progress.update({7.2, -1, 1.5}, gate);
  EXPECT_TRUE(progress.update({7.2, 1, 1.5}, gate));
}

TEST(CourseProgress, HowFarOffACrossingMayBeGoesWithTheGatesSize) {
  for (const double size : {0.4, 2.0}) {
    Course course = square_course(1);
    for (Waypoint& waypoint : course.waypoints) waypoint.gate.inner_half_m *= size;
    const auto counts = [&](double off_m) {
      CourseProgress progress(course);
      GateBelief gate = progress.nominal(0);
      gate.seen = true;
      progress.update({6 + off_m, -1, 1.5}, gate);
      return progress.update({6 + off_m, 1, 1.5}, gate);
    };
    EXPECT_TRUE(counts(0.74 * size)) << size;
    EXPECT_FALSE(counts(0.76 * size)) << size;
  }
}

TEST(CourseProgress, ACrossingOfWhatWasBelievedBeforeTheGateWasNearCounts) {
  const auto counts = [](const Eigen::Vector3d& moved_W, double turned_rad, const Eigen::Vector3d& p_W) {
    CourseProgress progress(square_course(1));
    GateBelief gate = progress.nominal(0);  // at (6, 0, 1.5), passed along y
    gate.seen = true;
    for (const double y_m : {-1.4, -1.2, -0.8}) progress.update({6, y_m, 1.5}, gate);
    gate.center_W += moved_W;
    gate.axis_W = Eigen::AngleAxisd(turned_rad, Eigen::Vector3d::UnitZ()) * gate.axis_W;
    progress.update({6, -0.1, 1.5}, gate);
    return progress.update(p_W, gate);
  };
  EXPECT_TRUE(counts({0, 0, -0.9}, 0.0, {6, 0.1, 1.5})) << "slid into the room below";
  EXPECT_TRUE(counts({0, 0.5, 0}, 1.2, {6, 0.1, 1.5})) << "turned";
  EXPECT_FALSE(counts({0, 0.2, 0}, 0.0, {6, 0.1, 1.5})) << "refined: the newer word counts";
  EXPECT_FALSE(counts({0, 0, -0.9}, 0.0, {7.8, 0.1, 1.5})) << "beside either";
}

/// A gate that is passed twice along +x, and once more the other way.
Course one_gate_thrice() {
  Course course;
  course.closed = false;
  course.waypoints = {
      {{5, 0, 1.5}, {1, 0, 0}, {}, 1}, {{5, 0, 1.5}, {1, 0, 0}, {}, 1}, {{5, 0, 1.5}, {-1, 0, 0}, {}, 1}};
  return course;
}

TEST(CourseProgress, OneGateTwiceInARowCountsOnceMoreFromInFrontOfItOnly) {
  CourseProgress progress(one_gate_thrice());
  GateBelief gate = progress.nominal(0);
  gate.seen = true;
  progress.update({4.9, 0, 1.5}, gate);
  ASSERT_TRUE(progress.update({5.02, 0, 1.5}, gate));
  gate.center_W.x() = 5.05;  // the newest frame places it farther on
  EXPECT_FALSE(progress.update({5.03, 0, 1.5}, gate));
  EXPECT_FALSE(progress.update({5.12, 0, 1.5}, gate)) << "the same passage";
  EXPECT_FALSE(progress.update({6.0, 1.5, 1.5}, gate));
  EXPECT_FALSE(progress.update({4.0, 1.5, 1.5}, gate));
  EXPECT_FALSE(progress.update({4.5, 0, 1.5}, gate));
  EXPECT_TRUE(progress.update({5.2, 0, 1.5}, gate));
  EXPECT_EQ(progress.target(), 2u);

  gate.axis_W = progress.nominal(2).axis_W;  // and back
  EXPECT_FALSE(progress.update({5.1, 0, 1.5}, gate));
  EXPECT_FALSE(progress.update({5.3, 0, 1.5}, gate));
  EXPECT_TRUE(progress.update({4.9, 0, 1.5}, gate));
  EXPECT_TRUE(progress.done());
}

TEST(CourseProgress, ALapOfOneGateIsOneGateInARow) {
  Course course = one_gate_thrice();
  course.waypoints.resize(1);
  course.laps = 2;
  CourseProgress progress(course);
  GateBelief gate = progress.nominal(0);
  gate.seen = true;
  progress.update({4.9, 0, 1.5}, gate);
  ASSERT_TRUE(progress.update({5.02, 0, 1.5}, gate));
  EXPECT_EQ(progress.lap(), 1u);
  gate.center_W.x() = 5.05;
  EXPECT_FALSE(progress.update({5.12, 0, 1.5}, gate));

  // Whoever takes over behind it has the way around before him: nobody can tell that it was done already.
  CourseProgress resumed(course);
  resumed.resume(0, 1);
  EXPECT_FALSE(resumed.update({6.0, 0, 1.5}, gate));
  EXPECT_EQ(resumed.lap(), 1u);
}

TEST(CourseProgress, WhatBeginsElsewhereCrossedNothingOnTheWay) {
  CourseProgress progress(square_course(1));
  const GateBelief gate = progress.nominal(0);
  progress.update({6, -1, 1.5}, gate);
  progress.begin_elsewhere();
  EXPECT_FALSE(progress.update({6, 1, 1.5}, gate));
  EXPECT_FALSE(progress.update({6, -1, 1.5}, gate));
  EXPECT_TRUE(progress.update({6, 1, 1.5}, gate));
}

TEST(CourseProgress, CountsLapsAndEnds) {
  CourseProgress progress(square_course(2));
  for (int lap = 0; lap < 2; ++lap)
    for (std::uint32_t i = 0; i < 4; ++i) {
      EXPECT_EQ(progress.target(), i);
      EXPECT_EQ(progress.lap(), static_cast<std::uint32_t>(lap));
      EXPECT_EQ(progress.has_next(), !(lap == 1 && i == 3));
      const GateBelief gate = progress.nominal(i);
      progress.update(gate.center_W - gate.axis_W, gate);
      EXPECT_TRUE(progress.update(gate.center_W + gate.axis_W, gate));
    }
  EXPECT_TRUE(progress.done());
  const GateBelief gate = progress.nominal(0);
  progress.update(gate.center_W - gate.axis_W, gate);
  EXPECT_FALSE(progress.update(gate.center_W + gate.axis_W, gate));
}

TEST(CourseProgress, ResumesWhereItWasToldAndIgnoresNonsense) {
  CourseProgress progress(square_course(3));
  progress.resume(2, 1);
  EXPECT_EQ(progress.target(), 2u);
  EXPECT_EQ(progress.lap(), 1u);
  progress.resume(99, 1);
  progress.resume(1, 99);
  EXPECT_EQ(progress.target(), 2u);
  EXPECT_EQ(progress.lap(), 1u);
}

TEST(CourseProgress, AGateCoastedThroughWhileNobodyPlannedCountsAfterResuming) {
  /// Whether the gate it is resumed at counts, of a vehicle that hovers at `p_W`.
  const auto counts = [](std::uint32_t waypoint, std::uint32_t lap, const Eigen::Vector3d& p_W) {
    CourseProgress progress(square_course(3));
    progress.resume(waypoint, lap);
    const GateBelief gate = progress.nominal(waypoint);
    EXPECT_FALSE(progress.update(p_W, gate)) << "the first state alone may be a false one";
    const bool counted = progress.update(p_W, gate);
    EXPECT_EQ(progress.target(), counted ? waypoint + 1 : waypoint);
    EXPECT_FALSE(progress.update(p_W, progress.nominal(progress.target()))) << "once";
    return counted;
  };
  EXPECT_TRUE(counts(2, 1, {-6.3, -1.0, 1.2}));  // the gate at (-6, 0), passed along -y
  EXPECT_TRUE(counts(2, 1, {-4.5, -3.5, 1.2}));
  EXPECT_FALSE(counts(2, 1, {-6.3, 1.0, 1.2})) << "before it";
  EXPECT_FALSE(counts(0, 0, {5.5, 1.0, 1.2})) << "at its very beginning nothing was passed";
  EXPECT_FALSE(counts(2, 1, {2.0, -1.0, 1.2})) << "elsewhere";
}

TEST(CourseProgress, AGateThatWasPassedWhileNobodyHeardOfTheVehicleCounts) {
  CourseProgress progress(square_course(3));
  const GateBelief first = progress.nominal(0);  // at (6, 0), passed along y
  EXPECT_FALSE(progress.update({6.0, -2.0, 1.2}, first));
  progress.away();
  EXPECT_FALSE(progress.update({5.0, 2.5, 1.2}, first)) << "a straight line would lead past the opening";
  EXPECT_TRUE(progress.update({5.0, 2.5, 1.2}, first));
  EXPECT_EQ(progress.target(), 1u);

  progress.away();
  EXPECT_FALSE(progress.update({1.0, 5.8, 1.2}, progress.nominal(1)));
  EXPECT_FALSE(progress.update({1.0, 5.8, 1.2}, progress.nominal(1))) << "before it still";
  EXPECT_EQ(progress.target(), 1u);
}

TEST(CourseProgress, AFirstStateThatTheNextOnesContradictCountsNothing) {
  CourseProgress progress(square_course(3));
  progress.resume(2, 1);
  const GateBelief gate = progress.nominal(2);
  EXPECT_FALSE(progress.update({-6.3, -1.0, 1.2}, gate));
  progress.begin_elsewhere();
  EXPECT_FALSE(progress.update({-6.3, 1.0, 1.2}, gate));
  EXPECT_FALSE(progress.update({-6.3, 0.9, 1.2}, gate));
  EXPECT_TRUE(progress.update({-6.3, -0.1, 1.2}, gate)) << "passed now";
}

}  // namespace
}  // namespace gatefield::gates
