#include "client/bridge/betaflight/throttle_curve.h"

#include <gtest/gtest.h>

#include <limits>

namespace gatefield::bridge::betaflight {
namespace {

using Limit = msp::RcTuning::ThrottleLimit;

msp::RcTuning tuning(int mid = 50, int expo = 0, Limit limit = Limit::kOff, int percent = 100) {
  msp::RcTuning made;
  made.throttle_mid = mid;
  made.throttle_expo = expo;
  made.throttle_limit = limit;
  made.throttle_limit_percent = percent;
  return made;
}

TEST(BetaflightThrottleCurve, WithoutCurveItGoesStraightFromMinCheckToTheEnd) {
  const ThrottleCurve curve(tuning(), {});
  EXPECT_EQ(curve.throttle(1000), 0.0);
  EXPECT_EQ(curve.throttle(1050), 0.0);
  EXPECT_NEAR(curve.throttle(1525), 0.5, 1e-9);
  EXPECT_NEAR(curve.throttle(1240), 0.2, 1e-9);
  EXPECT_EQ(curve.throttle(2000), 1.0);
}

TEST(BetaflightThrottleCurve, MiddleAndBendAreThoseOfTheFirmwaresTable) {
  // mid 30, expo 50: points of the table worked out by hand in whole numbers
  //   i = 3: t = 0                 -> 300
  //   i = 10: t = 70, y = 70       -> 300 + 70 * (50 + 50) / 10 = 1000
  //   i = 6: t = 30, y = 70        -> 300 + 30 * (50 + 50 * 900 / 4900) / 10 = 300 + 30 * 59 / 10 = 477
  //   i = 1: t = -20, y = 30       -> 300 - 20 * (50 + 50 * 400 / 900) / 10 = 300 - 144 = 156
  msp::RxConfig config;
  config.min_check = 1000;
  const ThrottleCurve curve(tuning(30, 50), config);
  EXPECT_NEAR(curve.throttle(1300), 0.300, 1e-9);
  EXPECT_NEAR(curve.throttle(1600), 0.477, 1e-9);
  EXPECT_NEAR(curve.throttle(1100), 0.156, 1e-9);
  EXPECT_NEAR(curve.throttle(2000), 1.0, 1e-9);
}

TEST(BetaflightThrottleCurve, LimitsScaleOrClip) {
  const ThrottleCurve scaled(tuning(50, 0, Limit::kScale, 80), {});
  EXPECT_NEAR(scaled.throttle(1525), 0.4, 1e-9);
  EXPECT_NEAR(scaled.max_throttle(), 0.8, 1e-9);
  const ThrottleCurve clipped(tuning(50, 0, Limit::kClip, 80), {});
  EXPECT_NEAR(clipped.throttle(1525), 0.5, 1e-9);
  EXPECT_NEAR(clipped.max_throttle(), 0.8, 1e-9);
  EXPECT_NEAR(clipped.throttle(clipped.pulse_us(0.95)), 0.8, 1e-9);
}

TEST(BetaflightThrottleCurve, TheInverseIsTheNearestThatCanBeAskedFor) {
  for (const int mid : {0, 1, 20, 50, 99, 100})
    for (const int expo : {0, 40, 100})
      for (const int min_check : {800, 1000, 1050, 1200}) {
        msp::RxConfig config;
        config.min_check = min_check;
        const ThrottleCurve curve(tuning(mid, expo), config);
        for (double wanted = 0.0; wanted <= 1.0; wanted += 0.013) {
          const int us = curve.pulse_us(wanted);
          ASSERT_GE(us, std::max(1000, min_check));
          ASSERT_LE(us, 2000);
          const double error = std::abs(curve.throttle(us) - wanted);
          for (const int beside : {us - 1, us + 1})
            if (beside >= 1000 && beside <= 2000) {
              ASSERT_LE(error, std::abs(curve.throttle(beside) - wanted) + 1e-12);
            }
        }
      }
}

TEST(BetaflightThrottleCurve, InFlightTheStickIsNeverPulledDown) {
  const ThrottleCurve curve(tuning(), {});
  for (const double throttle : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(curve.pulse_us(throttle), 1050);
  EXPECT_EQ(curve.pulse_us(5.0), 2000);
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
