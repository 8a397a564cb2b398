#include "server/pilot/rate_lags.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/random.h"

namespace gatefield::pilot {
namespace {

using namespace std::chrono_literals;

Actuation told() { return {Actuation::Kind::kBodyRates, 0.025, {0.04, 0.04, 0.08}}; }

/// Flies a while by commands that change at random four times a second, with true lags of told times `factor` and noise
/// on what is measured; states come every 20 ms.
RateLags flown(double factor, double noise_rad_s, double size_rad_s = 2.0, double seconds_flown = 4.0) {
  RateLags lags(told());
  Random random(3);
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  RateCommand asked = RateCommand::Zero();
  for (int i = 0; i < static_cast<int>(seconds_flown / 0.02); ++i) {
    if (i % 12 == 0)
      for (int a = 1; a < 4; ++a) asked[a] = size_rad_s * random.normal();
    lags.follow(asked, 20ms);
    for (int a = 0; a < 3; ++a)
      w[a] += (1.0 - std::exp(-0.02 / (factor * told().rate_time_constant_s[a]))) * (asked[a + 1] - w[a]);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    lags.observe(w + noise_rad_s * noise, 20ms);
  }
  return lags;
}

TEST(RateLags, FindsThemInSpiteOfNoise) {
  for (const double factor : {0.5, 0.67, 1.0, 1.5, 2.0}) {
    const RateLags lags = flown(factor, 0.1);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(lags.lag_s(axis)) << factor;
      EXPECT_NEAR(*lags.lag_s(axis) / told().rate_time_constant_s[axis], factor, 0.15 * factor) << "axis " << axis;
    }
  }
}

TEST(RateLags, TellsThoseThatAreUnlikeWhatWasTold) {
  EXPECT_FALSE(flown(1.0, 0.1).unlike_told());
  EXPECT_FALSE(flown(1.15, 0.1).unlike_told());
  EXPECT_TRUE(flown(2.0, 0.1).unlike_told());
  EXPECT_TRUE(flown(0.5, 0.1).unlike_told());
}

TEST(RateLags, SayNothingBeforeEnoughWasSeen) {
  EXPECT_FALSE(flown(2.0, 0.1, 2.0, 1.0).lag_s(0)) << "too short";
  EXPECT_FALSE(flown(2.0, 0.1, 0.05).lag_s(0)) << "hardly moved";
}

TEST(RateLags, BeginAnewFromWhatWasMeasuredAfterAnInterruption) {
  RateLags lags = flown(1.0, 0.0);
  // Meanwhile something else turned the vehicle.
  lags.interrupt({5, 5, 5});
  lags.follow({10, 5, 5, 5}, 20ms);
  lags.observe({5, 5, 5}, 20ms);
  EXPECT_FALSE(lags.unlike_told());
}

}  // namespace
}  // namespace gatefield::pilot
