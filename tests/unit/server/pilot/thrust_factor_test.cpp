#include "server/pilot/thrust_factor.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();
constexpr double kDt_s = 0.02;
const double kHoverPush_m_s = kGravity_m_s2 * kDt_s;

/// A vehicle that gives `truth` times what it is asked for, hovering on the spot by it, for a while.
void hover(ThrustFactor* factor, double truth, int samples) {
  for (int i = 0; i < samples; ++i)
    factor->observe((truth - factor->value()) * kHoverPush_m_s * kUp, kUp, kHoverPush_m_s, 20ms);
}

TEST(ThrustFactor, FindsWhatTheVehicleGivesBeyondWhatItIsAskedFor) {
  for (const double truth : {0.8, 1.0, 1.1, 1.3}) {
    ThrustFactor factor;
    hover(&factor, truth, 100);
    EXPECT_NEAR(factor.value(), truth, 0.01);
    EXPECT_EQ(factor.unlike_told(), std::abs(truth - 1.0) > ThrustFactor::kUnlike);
  }
}

TEST(ThrustFactor, IsNotToldBeforeThereWasTimeToFindIt) {
  ThrustFactor factor;
  hover(&factor, 1.5, 40);  // 0.8 s
  EXPECT_GT(factor.value(), 1.3);
  EXPECT_FALSE(factor.unlike_told());
}

TEST(ThrustFactor, WindAcrossTheThrustIsNoneOfIts) {
  ThrustFactor factor;
  for (int i = 0; i < 100; ++i) factor.observe(0.5 * Eigen::Vector3d::UnitX(), kUp, kHoverPush_m_s, 20ms);
  EXPECT_EQ(factor.value(), 1.0);
}

TEST(ThrustFactor, FallingAndNonsenseSayNothing) {
  ThrustFactor factor;
  factor.observe(kUp, kUp, 0.1 * kHoverPush_m_s, 20ms);
  factor.observe({std::numeric_limits<double>::quiet_NaN(), 0, 0}, kUp, kHoverPush_m_s, 20ms);
  factor.observe(kUp, kUp, kHoverPush_m_s, 0ms);
  EXPECT_EQ(factor.value(), 1.0);
}

TEST(ThrustFactor, ACollisionIsBounded) {
  ThrustFactor factor;
  factor.observe(-20.0 * kUp, kUp, kHoverPush_m_s, 20ms);
  EXPECT_GT(factor.value(), 0.97);
  for (int i = 0; i < 1000; ++i) factor.observe(-20.0 * kUp, kUp, kHoverPush_m_s, 20ms);
  EXPECT_EQ(factor.value(), ThrustFactor::kLow);
}

}  // namespace
}  // namespace gatefield::pilot
