#include "client/bridge/sources/motion_filter.h"

#include <gtest/gtest.h>

#include <random>

namespace gatefield::bridge::sources {
namespace {

using namespace std::chrono_literals;

Eigen::Quaterniond turned(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis.normalized()));
}

TEST(MotionFilter, OfSteadyMotionItMakesItsVelocitiesAndSaysItsLag) {
  MotionFilter filter(30ms);
  const Eigen::Vector3d v(3, -2, 0.5), w(0.5, 2.0, -1.0);  // about axes of the body, which keep still for a steady turn
  const Eigen::Quaterniond q_0 = turned({1, 2, 3}, 2.9);
  std::optional<MotionFilter::Motion> motion;
  for (Stamp t{0}; t <= 1s; t += 5ms) {
    const double t_s = seconds(t);
    const Eigen::Quaterniond q = q_0 * turned(w, w.norm() * t_s);
    const bool other_sign = (t / 5ms) % 2 == 1;  // both quaternions of an attitude mean the same
    motion = filter.take(10s + t, v * t_s, other_sign ? Eigen::Quaterniond(-q.coeffs()) : q);
  }
  ASSERT_TRUE(motion);
  EXPECT_TRUE(motion->v_W.isApprox(v, 1e-9)) << motion->v_W.transpose();
  EXPECT_TRUE(motion->w_B.isApprox(w, 1e-6)) << motion->w_B.transpose();
  EXPECT_EQ(std::chrono::round<std::chrono::microseconds>(motion->lag), 15ms);
}

TEST(MotionFilter, AnAcceleratedVelocityIsThatOfTheLagBefore) {
  MotionFilter filter(40ms);
  std::optional<MotionFilter::Motion> motion;
  const double a_m_s2 = 8.0;
  for (Stamp t{0}; t <= 1s; t += 4ms)
    motion = filter.take(t, {0.5 * a_m_s2 * seconds(t) * seconds(t), 0, 0}, Eigen::Quaterniond::Identity());
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->v_W.x(), a_m_s2 * (1.0 - seconds(motion->lag)), 1e-9);
}

TEST(MotionFilter, NoiseIsDampedAsItsFormulaSays) {
  MotionFilter filter(30ms);
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 2e-4);
  double sum = 0.0;
  int count = 0;
  for (Stamp t{0}; t < 20s; t += 4166us) {
    const auto motion = filter.take(t, {noise(random), 0, 0}, Eigen::Quaterniond::Identity());
    if (!motion) continue;
    sum += motion->v_W.x() * motion->v_W.x();
    ++count;
  }
  const double n = 8.0, expected = 2e-4 * std::sqrt(12.0 / (n * n * n)) / 4.166e-3;
  EXPECT_NEAR(std::sqrt(sum / count), expected, 0.2 * expected);
}

TEST(MotionFilter, AGapBeginsAnew) {
  MotionFilter filter(30ms);
  for (Stamp t{0}; t < 100ms; t += 5ms) (void)filter.take(t, {0, 0, 0}, Eigen::Quaterniond::Identity());
  EXPECT_FALSE(filter.take(250ms, {1, 0, 0}, Eigen::Quaterniond::Identity()));
  EXPECT_FALSE(filter.take(255ms, {1, 0, 0}, Eigen::Quaterniond::Identity()));
  EXPECT_FALSE(filter.take(260ms, {1, 0, 0}, Eigen::Quaterniond::Identity())) << "three, but over too little time";
  const auto motion = filter.take(265ms, {1, 0, 0}, Eigen::Quaterniond::Identity());
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->v_W, Eigen::Vector3d::Zero());
}

TEST(MotionFilter, MorePosesThanItKeepsShortenTheLag) {
  MotionFilter filter(200ms);
  std::optional<MotionFilter::Motion> motion;
  for (Stamp t{0}; t < 1s; t += 1ms) motion = filter.take(t, {seconds(t), 0, 0}, Eigen::Quaterniond::Identity());
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->v_W.x(), 1.0, 1e-9);
  EXPECT_LT(motion->lag, 40ms);
}

}  // namespace
}  // namespace gatefield::bridge::sources
