#include "server/pilot/rate_limits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/base/random.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

constexpr double kNone = 1e9;

Actuation told() { return {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}}; }
Eigen::Vector3d at_most() { return {9, 9, 6}; }

/// A vehicle that turns by commands which change at random four times a second; states come every 20 ms.
struct Vehicle {
  double limit_rad_s = kNone;
  double lag_factor = 1.0;  ///< true lags against those told
  double acceleration_rad_s2 = kNone;
  double noise_rad_s = 0.1;
  double size_rad_s = 3.0;  ///< of the commands, one sigma
  std::uint64_t seed = 3;

  void fly(RateLimits* limits, Stamp span) {
    Random random(seed);
    RateCommand asked = RateCommand::Zero();
    for (int i = 0; i < static_cast<int>(span / 20ms); ++i) {
      if (i % 12 == 0)
        for (int a = 1; a < 4; ++a)
          asked[a] = std::clamp(size_rad_s * random.normal(), -at_most()[a - 1], at_most()[a - 1]);
      limits->follow(asked, 20ms);
      for (int a = 0; a < 3; ++a)
        for (int ms = 0; ms < 20; ++ms) {
          const double behind = std::clamp(asked[a + 1], -limit_rad_s, limit_rad_s) - w_B[a];
          const double step = (1.0 - std::exp(-0.001 / (lag_factor * told().rate_time_constant_s[a]))) * behind;
          w_B[a] += std::clamp(step, -0.001 * acceleration_rad_s2, 0.001 * acceleration_rad_s2);
        }
      const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
      limits->observe(w_B + noise_rad_s * noise, 20ms);
    }
  }

  Eigen::Vector3d w_B = Eigen::Vector3d::Zero();
};

RateLimits flown(Vehicle vehicle, Stamp span = 6s) {
  RateLimits limits(told(), at_most());
  vehicle.fly(&limits, span);
  return limits;
}

TEST(RateLimits, FindsALimitWhateverLagAndNoise) {
  for (const double limit : {1.5, 2.0, 3.0})
    for (const double lag : {0.67, 1.0, 1.5})
      for (const double noise : {0.0, 0.1, 0.3}) {
        const RateLimits limits = flown({.limit_rad_s = limit, .lag_factor = lag, .noise_rad_s = noise});
        EXPECT_TRUE(limits.unlike_told());
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(limits.limit_rad_s()[axis], limit, 0.1 * limit)
              << "axis " << axis << ", lag " << lag << ", noise " << noise;
      }
}

TEST(RateLimits, NeitherALagNorABoundOfTorqueNorNoiseIsTakenForOne) {
  int flights = 0;
  for (std::uint64_t seed = 1; seed <= 25; ++seed)
    for (const double lag : {0.5, 1.0, 2.0})
      for (const double acceleration : {15.0, 40.0, kNone}) {
        const RateLimits limits =
            flown({.lag_factor = lag, .acceleration_rad_s2 = acceleration, .noise_rad_s = 0.3, .seed = seed});
        EXPECT_TRUE(limits.limit_rad_s().isZero(0.0)) << "seed " << seed << ", lag " << lag << ", acceleration "
                                                      << acceleration << ": " << limits.limit_rad_s().transpose();
        ++flights;
      }
  EXPECT_EQ(flights, 225);
}

TEST(RateLimits, OneThatIsNotMetIsNotKnown) {
  EXPECT_TRUE(flown({.limit_rad_s = 3.0, .size_rad_s = 0.8}).limit_rad_s().isZero(0.0));
}

TEST(RateLimits, WhatIsAskedForIsTakenAsTheVehicleTakesIt) {
  const RateLimits limits = flown({.limit_rad_s = 2.0});
  const RateCommand taken = limits.limited({5, 1, -7, 0});
  EXPECT_EQ(taken[0], 5) << "thrust is none of its";
  EXPECT_EQ(taken[1], 1);
  EXPECT_NEAR(taken[2], -2, 0.2);
}

TEST(RateLimits, OneThatIsThereNoMoreIsForgotten) {
  RateLimits limits(told(), at_most());
  Vehicle vehicle{.limit_rad_s = 2.0};
  vehicle.fly(&limits, 6s);
  ASSERT_FALSE(limits.limit_rad_s().isZero(0.0));
  vehicle.limit_rad_s = kNone;
  vehicle.fly(&limits, 6s);
  EXPECT_TRUE(limits.limit_rad_s().isZero(0.0)) << limits.limit_rad_s().transpose();
}

TEST(RateLimits, BeginAnewFromWhatWasMeasuredAfterAnInterruption) {
  RateLimits limits(told(), at_most());
  for (int i = 0; i < 100; ++i) {
    limits.interrupt({5, 5, 5});  // something else turned the vehicle meanwhile
    limits.follow({10, 5, 5, 5}, 20ms);
    limits.observe({5, 5, 5}, 20ms);
  }
  EXPECT_TRUE(limits.limit_rad_s().isZero(0.0));
}

}  // namespace
}  // namespace gatefield::pilot
