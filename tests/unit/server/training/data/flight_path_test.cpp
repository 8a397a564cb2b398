#include "server/training/data/flight_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace gatefield::training {
namespace {

using Eigen::Vector3d;

/// Around the origin, counter-clockwise.
Path circle(double radius_m) {
  std::vector<Vector3d> points, directions;
  for (int k = 0; k < 8; ++k) {
    const double angle = 0.25 * std::numbers::pi * k;
    points.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle), 1.5);
    directions.emplace_back(-std::sin(angle), std::cos(angle), 0.0);
  }
  return round_path(points, directions);
}

TEST(FlightPath, GoesThroughItsPointsInEvenSteps) {
  const Path path = circle(4.0);
  EXPECT_NEAR(path.step_m * static_cast<double>(path.size()), 2.0 * std::numbers::pi * 4.0, 0.3);
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_NEAR((path.p_W[(i + 1) % path.size()] - path.p_W[i]).norm(), path.step_m, 0.01 * path.step_m);
    EXPECT_NEAR(path.p_W[i].head<2>().norm(), 4.0, 0.06);
    EXPECT_NEAR(path.curvature[i].norm(), 0.25, 0.05);
    EXPECT_LT(path.curvature[i].dot(path.p_W[i]), 0.0) << "to the inside";
  }
}

TEST(FlightPath, IsFlyableWhenItBendsLittleAndTouchesNothing) {
  EXPECT_TRUE(flyable(circle(4.0), {}, {}, 0.3));
  EXPECT_FALSE(flyable(circle(0.4), {}, {}, 0.3)) << "too sharp";
  scene::Box box{.half_m = {0.5, 0.5, 2.0}};
  box.X_WO.translation() = Vector3d(3.0, 0.0, 1.5);  // its side is 0.5 m away
  EXPECT_TRUE(flyable(circle(4.0), {}, {box}, 0.4));
  EXPECT_FALSE(flyable(circle(4.0), {}, {box}, 0.6));
}

TEST(FlightPath, SpeedFollowsTheCurveAndHasNoJumps) {
  const Path path = circle(1.0);
  const std::vector<double> speed_m_s = plan_speed(path, 9.0);
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_LE(speed_m_s[i] * speed_m_s[i] * path.curvature[i].norm(), 16.0 + 1e-9);
    const double next_m_s = speed_m_s[(i + 1) % path.size()];
    EXPECT_LE(std::abs(next_m_s * next_m_s - speed_m_s[i] * speed_m_s[i]), 2.0 * 6.0 * path.step_m + 1e-9);
  }
  const std::vector<double> slow_m_s = plan_speed(path, 2.0);
  EXPECT_DOUBLE_EQ(*std::min_element(slow_m_s.begin(), slow_m_s.end()), 2.0);
}

TEST(FlightPath, ValuesBetweenEntriesGoRound) {
  const std::vector<double> list{0.0, 10.0, 20.0};
  EXPECT_DOUBLE_EQ(between(list, 0.25), 2.5);
  EXPECT_DOUBLE_EQ(between(list, 2.5), 10.0) << "the last and the first";
  EXPECT_DOUBLE_EQ(between(list, 4.0), 10.0);
}

}  // namespace
}  // namespace gatefield::training
