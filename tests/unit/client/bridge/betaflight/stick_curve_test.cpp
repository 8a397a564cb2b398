#include "client/bridge/betaflight/stick_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace gatefield::bridge::betaflight {
namespace {

using Axis = msp::RcTuning::Axis;
using Type = msp::RcTuning::RatesType;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::array kTypes{Type::kBetaflight, Type::kRaceflight, Type::kKiss, Type::kActual, Type::kQuick};

double deg_s(const StickCurve& curve, int us) { return curve.rate_rad_s(us) / kDegree; }

/// Values worked out by hand from the formulas, at a quarter, half and full stick.
struct Known {
  Type type;
  Axis axis;
  double quarter, half, full;
};

TEST(BetaflightStickCurve, GivesTheRatesThatTheFirmwareShows) {
  for (const Known& known : {
           Known{Type::kActual, {7, 67, 0, 1998}, 17.5 + 37.5, 35 + 150, 670},  // the firmware's default
           Known{Type::kActual,
                 {7, 67, 54, 1998},
                 17.5 + 600 * 0.25 * (std::pow(0.25, 5) * 0.54 + 0.25 * 0.46),
                 35 + 600 * 0.5 * (0.03125 * 0.54 + 0.5 * 0.46),
                 670},
           Known{Type::kActual, {100, 100, 0, 1998}, 250, 500, 1000},  // 2 deg/s a microsecond
           Known{Type::kBetaflight, {100, 70, 0, 1998}, 50 / 0.825, 100 / 0.65, 200 / 0.3},
           Known{Type::kBetaflight, {250, 0, 0, 1998}, 50 * 9.77, 100 * 9.77, 200 * 9.77},  // beyond 2: 2.5 + 14.54 / 2
           Known{Type::kBetaflight,
                 {100, 0, 40, 1998},
                 200 * (std::pow(0.25, 4) * 0.4 + 0.15),
                 200 * (0.0625 * 0.4 + 0.3),
                 200},
           Known{Type::kKiss, {100, 70, 0, 1998}, 50 / 0.825, 100 / 0.65, 200 / 0.3},
           Known{Type::kQuick, {100, 67, 0, 1998}, 50 / (1 - 0.25 * 47.0 / 67), 100 / (1 - 0.5 * 47.0 / 67), 670},
           Known{Type::kRaceflight,
                 {37, 80, 50, 1998},
                 370 * (1 + 0.5 * (0.0625 - 1)) * 0.25 * 1.2,
                 370 * (1 + 0.5 * -0.75) * 0.5 * 1.4,
                 370 * 1.8},
       }) {
    const StickCurve curve(known.type, known.axis, 0);
    EXPECT_NEAR(deg_s(curve, 125), known.quarter, 1e-6);
    EXPECT_NEAR(deg_s(curve, 250), known.half, 1e-6);
    EXPECT_NEAR(deg_s(curve, 500), known.full, 1e-6);
    EXPECT_NEAR(deg_s(curve, -250), -known.half, 1e-6) << "left is as right";
    EXPECT_EQ(deg_s(curve, 0), 0.0);
  }
}

TEST(BetaflightStickCurve, TheInverseIsTheNearestThatCanBeAskedFor) {
  for (const Type type : kTypes) {
    for (const int super_rate : {0, 30, 67, 90}) {
      for (const int expo : {0, 30, 100}) {
        for (const int deadband : {0, 5, 32}) {
          const StickCurve curve(type, {type == Type::kActual ? 10 : 90, super_rate, expo, 1998}, deadband);
          for (double rate = -curve.max_rad_s(); rate <= curve.max_rad_s(); rate += curve.max_rad_s() / 137) {
            const int us = curve.deflection_us(rate);
            ASSERT_LE(std::abs(us), 500);
            const double error = std::abs(curve.rate_rad_s(us) - rate);
            for (const int beside : {us - 1, us + 1})
              if (std::abs(beside) <= 500) {
                ASSERT_LE(error, std::abs(curve.rate_rad_s(beside) - rate) + 1e-12);
              }
          }
        }
      }
    }
  }
}

TEST(BetaflightStickCurve, WhatItGivesIsGivenBack) {
  const StickCurve curve(Type::kActual, {20, 67, 30, 1998}, 0);
  for (int us = -500; us <= 500; ++us) EXPECT_EQ(curve.deflection_us(curve.rate_rad_s(us)), us);
}

TEST(BetaflightStickCurve, MoreThanTheAxisHasIsItsEnd) {
  const StickCurve curve(Type::kActual, {7, 67, 0, 400}, 0);
  EXPECT_NEAR(curve.max_rad_s(), 400 * kDegree, 1e-9) << "its limit";
  const int end = curve.deflection_us(100.0);
  EXPECT_NEAR(curve.rate_rad_s(end), 400 * kDegree, 1e-9);
  EXPECT_LT(end, 500) << "no farther than needed";
  EXPECT_EQ(curve.deflection_us(-100.0), -end);
}

TEST(BetaflightStickCurve, TheDeadBandIsLeapt) {
  const StickCurve curve(Type::kActual, {100, 100, 0, 1998}, 20);
  EXPECT_EQ(deg_s(curve, 20), 0.0);
  EXPECT_GT(deg_s(curve, 21), 0.0);
  EXPECT_GT(curve.deflection_us(2 * kDegree), 20);
  EXPECT_EQ(curve.deflection_us(0.0), 0);
  EXPECT_NEAR(deg_s(curve, 500), 1000, 1e-9);
}

TEST(BetaflightStickCurve, SettingsOfNothingGiveNothing) {
  for (const Type type : kTypes) {
    const StickCurve curve(type, {0, 0, 0, 1998}, 0);
    EXPECT_EQ(curve.max_rad_s(), 0.0);
    EXPECT_EQ(curve.deflection_us(3.0), 0);
  }
}

TEST(BetaflightStickCurve, AnySettingsGiveARateThatDoesNotFall) {
  for (const Type type : kTypes)
    for (const int rc_rate : {0, 1, 100, 255})
      for (const int super_rate : {0, 99, 100, 255})
        for (const int expo : {0, 100}) {
          const StickCurve curve(type, {rc_rate, super_rate, expo, 1998}, 0);
          for (int us = 1; us <= 500; ++us) {
            ASSERT_TRUE(std::isfinite(curve.rate_rad_s(us)));
            ASSERT_GE(curve.rate_rad_s(us), curve.rate_rad_s(us - 1));
          }
          ASSERT_LE(curve.max_rad_s(), 1998 * kDegree + 1e-9);
        }
}

TEST(BetaflightStickCurve, WhatIsNotFiniteAsksForNothing) {
  const StickCurve curve(Type::kActual, {7, 67, 0, 1998}, 0);
  EXPECT_EQ(curve.deflection_us(std::numeric_limits<double>::quiet_NaN()), 0);
  EXPECT_EQ(curve.deflection_us(std::numeric_limits<double>::infinity()), 0);
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
