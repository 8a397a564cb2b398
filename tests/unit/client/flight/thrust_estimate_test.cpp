#include "client/flight/thrust_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "common/base/random.h"
#include "tests/support/allocation_trap.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Motors and battery as they truly are, in a vehicle that flies up and down, always level.
struct Flight {
  QuadrotorModel model;
  /// Thrust over weight for throttle times the ratio of voltages.
  std::function<double(double)> curve = [](double drive) { return std::pow(drive / 0.3, 1.7); };
  double lag_s = 0.03;
  double battery_v = 16.0, reference_v = 16.0;
  double sag_v_per_s = 0.0;
  bool tells_battery = true, tells_force = true;
  double noise_m_s2 = 1.0;
  /// Acceleration wanted at a time, m/s^2.
  std::function<double(double)> wanted = [](double) { return 0.0; };
  /// What the ground or a hand adds, m/s^2.
  std::function<double(double)> pushed = [](double) { return 0.0; };

  double rotors = 0.3;  // the drive that they have come to
  double v_m_s = 0.0;
  Stamp now{0};
  Random random{7, Stream("gatefield.test.thrust_estimate")};

  void fly(ThrustEstimate* estimate, double seconds_long) {
    const Stamp end = now + from_seconds(seconds_long);
    for (; now < end; now += 4ms) {
      const double t = seconds(now);
      battery_v -= sag_v_per_s * 0.004;
      if (tells_battery) estimate->on_battery(battery_v);
      const double throttle = estimate->command(now, model.mass_kg * (kGravity_m_s2 + wanted(t)));
      rotors += (1 - std::exp(-0.004 / lag_s)) * (throttle * battery_v / reference_v - rotors);
      const double force =
          kGravity_m_s2 * curve(rotors) - model.drag_kg_s.z() * v_m_s / model.mass_kg + pushed(t);  // specific
      v_m_s += (force - kGravity_m_s2) * 0.004;
      QuadrotorState state;
      state.v_WB = {0, 0, v_m_s};
      const auto told = tells_force ? std::optional(force + noise_m_s2 * random.normal()) : std::nullopt;
      estimate->on_state(now + 4ms, state, told);
    }
  }
};

double wave(double t) { return 3.0 * std::sin(4.0 * t) + 2.0 * std::sin(1.3 * t); }

ThrustEstimate flying(const ThrustOptions& options, const QuadrotorModel& model = {}) {
  ThrustEstimate estimate(options, model);
  estimate.begin();
  return estimate;
}

TEST(ThrustEstimate, SaysTheConfigurationBeforeTheFlight) {
  const ThrustOptions options;
  const QuadrotorModel model;
  const double weight_n = model.mass_kg * kGravity_m_s2;
  const ThrustEstimate estimate(options, model);
  EXPECT_NEAR(estimate.throttle(weight_n), 0.30, 1e-12);
  EXPECT_NEAR(estimate.throttle(2 * weight_n), 0.30 * std::pow(2, 1 / 1.7), 1e-12);
  EXPECT_NEAR(estimate.collective_n(estimate.throttle(5.0)), 5.0, 1e-9);
  EXPECT_NEAR(estimate.hover_throttle(), 0.30, 1e-12);
  EXPECT_NEAR(estimate.factor(), 1.0, 1e-12);
  EXPECT_FALSE(estimate.contradicts());
}

TEST(ThrustEstimate, KeepsThrottleWithinItsLimits) {
  const ThrustOptions options;
  const ThrustEstimate estimate(options, {});
  for (const double thrust_n : {-1.0, 0.0, 1e-9, kNan}) EXPECT_EQ(estimate.throttle(thrust_n), options.throttle_min);
  EXPECT_EQ(estimate.throttle(1e4), options.throttle_max);
  EXPECT_EQ(estimate.throttle(std::numeric_limits<double>::infinity()), options.throttle_min);
}

TEST(ThrustEstimate, FindsAHoverThrottleThatWasToldWrong) {
  for (const double truth : {0.2, 0.26, 0.36, 0.45}) {
    ThrustOptions options;
    auto estimate = flying(options);
    Flight flight;
    flight.curve = [&](double drive) { return std::pow(drive / truth, 1.7); };
    flight.rotors = truth;
    flight.wanted = wave;
    flight.fly(&estimate, 6.0);
    EXPECT_NEAR(estimate.hover_throttle(), truth, 0.03 * truth);
    // What is asked for is what comes.
    const double weight_n = flight.model.mass_kg * kGravity_m_s2;
    for (const double load : {0.7, 1.0, 1.5})
      EXPECT_NEAR(flight.curve(estimate.throttle(load * weight_n)), load, 0.05 * load) << truth;
  }
}

TEST(ThrustEstimate, FindsTheExponentOfTheCurve) {
  for (const double truth : {1.2, 2.1}) {
    auto estimate = flying({});
    Flight flight;
    flight.curve = [&](double drive) { return std::pow(drive / 0.3, truth); };
    flight.wanted = wave;
    flight.fly(&estimate, 20.0);
    EXPECT_NEAR(estimate.exponent(), truth, 0.12);
    EXPECT_NEAR(estimate.hover_throttle(), 0.3, 0.01);
  }
}

TEST(ThrustEstimate, FitsACurveThatIsNoPower) {
  // PX4's THR_MDL_FAC: a mixture of linear and quadratic, here of a vehicle that could lift four times its weight.
  auto estimate = flying({});
  Flight flight;
  flight.curve = [](double drive) { return 4.0 * (0.6 * drive * drive + 0.4 * drive); };
  flight.wanted = wave;
  flight.fly(&estimate, 20.0);
  const double weight_n = flight.model.mass_kg * kGravity_m_s2;
  for (const double load : {0.7, 1.0, 1.4})
    EXPECT_NEAR(flight.curve(estimate.throttle(load * weight_n)), load, 0.06 * load);
}

TEST(ThrustEstimate, AHoverTellsTheHoverThrottleAndNothingOfTheExponent) {
  auto estimate = flying({});
  Flight flight;
  flight.curve = [](double drive) { return std::pow(drive / 0.33, 2.2); };
  flight.rotors = 0.33;
  flight.fly(&estimate, 30.0);
  EXPECT_NEAR(estimate.hover_throttle(), 0.33, 0.01);
  EXPECT_NEAR(estimate.exponent(), 1.7, 0.3);
}

TEST(ThrustEstimate, FollowsASaggingBatteryThatIsTold) {
  ThrustOptions options;
  options.reference_v = 16.0;
  auto estimate = flying(options);
  Flight flight;
  flight.wanted = wave;
  flight.sag_v_per_s = 3.0 / 60;
  flight.fly(&estimate, 60.0);  // 16 V to 13 V
  const double weight_n = flight.model.mass_kg * kGravity_m_s2;
  EXPECT_NEAR(flight.curve(estimate.throttle(weight_n) * flight.battery_v / 16.0), 1.0, 0.03);
  EXPECT_NEAR(estimate.hover_throttle(), 0.3, 0.01);  // at 16 V, still
  EXPECT_FALSE(estimate.contradicts());
}

TEST(ThrustEstimate, FollowsASaggingBatteryThatIsNotTold) {
  auto estimate = flying({});
  Flight flight;
  flight.wanted = wave;
  flight.tells_battery = false;
  flight.sag_v_per_s = 3.0 / 60;
  flight.fly(&estimate, 60.0);
  const double weight_n = flight.model.mass_kg * kGravity_m_s2;
  EXPECT_NEAR(flight.curve(estimate.throttle(weight_n) * flight.battery_v / 16.0), 1.0, 0.05);
}

TEST(ThrustEstimate, LeavesOutABatteryThatCannotBe) {
  ThrustOptions options;
  options.reference_v = 16.0;
  ThrustEstimate estimate(options, {});
  const double before = estimate.throttle(8.0);
  for (const double volts : {0.0, 7.9, 24.1, -16.0, kNan}) estimate.on_battery(volts);
  EXPECT_EQ(estimate.throttle(8.0), before);
  estimate.on_battery(12.0);
  EXPECT_NEAR(estimate.throttle(8.0), before * 16 / 12, 1e-9);
}

TEST(ThrustEstimate, LearnsFromVelocitiesWhereThereIsNoAccelerometer) {
  auto estimate = flying({});
  Flight flight;
  flight.curve = [](double drive) { return std::pow(drive / 0.36, 1.7); };
  flight.rotors = 0.36;
  flight.wanted = wave;
  flight.tells_force = false;
  flight.fly(&estimate, 8.0);
  EXPECT_NEAR(estimate.hover_throttle(), 0.36, 0.012);
}

TEST(ThrustEstimate, LearnsNothingBeforeBeginAndAfterEnd) {
  ThrustEstimate estimate({}, QuadrotorModel{});
  Flight flight;
  flight.curve = [](double drive) { return std::pow(drive / 0.4, 1.7); };
  flight.fly(&estimate, 2.0);
  EXPECT_EQ(estimate.taken() + estimate.outliers(), 0u);
  estimate.begin();
  flight.fly(&estimate, 2.0);
  const auto learned = estimate.taken();
  EXPECT_GT(learned, 100u);
  estimate.end();
  flight.fly(&estimate, 2.0);
  EXPECT_EQ(estimate.taken(), learned);
}

TEST(ThrustEstimate, LearnsNothingWhileTheThrottleIsAtALimit) {
  ThrustOptions options;
  options.throttle_max = 0.5;
  auto estimate = flying(options);
  Flight flight;
  flight.curve = [](double drive) { return std::pow(drive / 0.36, 1.7); };
  flight.wanted = [](double) { return 40.0; };
  flight.fly(&estimate, 3.0);
  EXPECT_EQ(estimate.taken() + estimate.outliers(), 0u);
}

TEST(ThrustEstimate, ABumpAndAPushOfAHandAreOutliers) {
  auto estimate = flying({});
  Flight flight;
  flight.wanted = wave;
  flight.fly(&estimate, 4.0);
  const double before = estimate.hover_throttle();
  flight.pushed = [](double t) { return t < 4.5 ? 12.0 : 0.0; };
  flight.fly(&estimate, 1.0);
  EXPECT_GT(estimate.outliers(), 20u);
  EXPECT_NEAR(estimate.hover_throttle(), before, 0.02 * before);
}

TEST(ThrustEstimate, BelievesWhatStaysDifferent) {
  auto estimate = flying({});
  Flight flight;
  flight.wanted = wave;
  flight.fly(&estimate, 10.0);
  flight.curve = [](double drive) { return 0.6 * std::pow(drive / 0.3, 1.7); };  // a propeller broke
  flight.fly(&estimate, 8.0);
  EXPECT_NEAR(estimate.factor(), 0.6, 0.04);
}

TEST(ThrustEstimate, StaysWithinBounds) {
  auto estimate = flying({});
  Flight flight;
  flight.curve = [](double drive) { return 30 * std::pow(drive / 0.3, 1.7); };
  flight.fly(&estimate, 10.0);
  EXPECT_GE(estimate.hover_throttle(), 0.3 / ThrustEstimate::kMaxFactor - 1e-9);
  EXPECT_GE(estimate.exponent(), 1.0);
  EXPECT_LE(estimate.exponent(), 2.5);
}

TEST(ThrustEstimate, WhatIsNotFiniteIsLeftOut) {
  auto estimate = flying({});
  QuadrotorState state;
  for (Stamp now{0}; now < 1s; now += 5ms) {
    estimate.command(now, 8.0);
    state.v_WB.setConstant(kNan);
    estimate.on_state(now, state, kNan);
    estimate.on_state(now, state, std::nullopt);
  }
  EXPECT_EQ(estimate.taken(), 0u);
  EXPECT_TRUE(std::isfinite(estimate.throttle(8.0)));
}

TEST(ThrustEstimate, SaysWhenItContradictsTheConfiguration) {
  ThrustOptions options;
  auto estimate = flying(options);
  Flight flight;
  flight.wanted = wave;
  flight.curve = [](double drive) { return 1.1 * std::pow(drive / 0.3, 1.7); };
  flight.fly(&estimate, 10.0);
  EXPECT_TRUE(agreement(estimate, options).ok()) << "10 % is within the factor";
  flight.curve = [](double drive) { return 1.6 * std::pow(drive / 0.3, 1.7); };
  flight.fly(&estimate, 10.0);
  const auto contradiction = agreement(estimate, options);
  ASSERT_FALSE(contradiction.ok());
  EXPECT_EQ(contradiction.failure().field, "hover_throttle");
  EXPECT_THAT(contradiction.error(), HasSubstr("hover_throttle is 0.3, expected about 0.2"));
  EXPECT_THAT(contradiction.error(), HasSubstr("times what was told"));
}

TEST(ThrustEstimate, AllocatesNothing) {
  auto estimate = flying({});
  Flight flight;
  flight.wanted = wave;
  flight.fly(&estimate, 0.1);
  const test::AllocationTrap trap;
  flight.fly(&estimate, 1.0);
  EXPECT_EQ(trap.count(), 0u);
}

TEST(ThrustOptions, RangesAreSaid) {
  EXPECT_TRUE(validate(ThrustOptions{}).ok());
  const auto refused = [](auto change, const char* field) {
    ThrustOptions options;
    change(&options);
    const auto status = validate(options);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, field);
  };
  for (const double bad : {0.02, 0.91, kNan}) {
    refused([&](auto* o) { o->hover_throttle = bad; }, "hover_throttle");
  }
  for (const double bad : {0.99, 2.6, kNan}) refused([&](auto* o) { o->exponent = bad; }, "exponent");
  for (const double bad : {1.9, 101.0, -1.0, kNan}) refused([&](auto* o) { o->reference_v = bad; }, "reference_v");
  for (const double bad : {-0.01, 0.51, kNan}) refused([&](auto* o) { o->throttle_min = bad; }, "throttle_min");
  for (const double bad : {0.1, 1.01, kNan}) refused([&](auto* o) { o->throttle_max = bad; }, "throttle_max");
  for (const double bad : {-0.01, 0.31, kNan}) refused([&](auto* o) { o->lag_s = bad; }, "lag_s");
  for (const double bad : {1.0, 3.1, kNan}) refused([&](auto* o) { o->trusted_factor = bad; }, "trusted_factor");
  refused([](auto* o) { o->throttle_min = 0.35; }, "hover_throttle");
  refused([](auto* o) { o->throttle_max = 0.25; }, "hover_throttle");
}

}  // namespace
}  // namespace gatefield::flight
