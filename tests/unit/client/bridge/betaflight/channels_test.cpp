#include "client/bridge/betaflight/channels.h"

#include <gtest/gtest.h>

#include <limits>

namespace gatefield::bridge::betaflight {
namespace {

Settings settings() {
  Settings made;
  made.tuning.axes.fill({20, 67, 0, 1998});
  made.map = {0, 1, 3, 2, 4, 5, 6, 7};  // AETR
  return made;
}

TEST(BetaflightChannels, SticksPointWhereTheFirmwaresAxesDo) {
  const Channels channels(settings(), {});
  const auto right = channels.flying({2, 0, 0}, 0.5, true);
  EXPECT_GT(right[0], 1500) << "roll to the right";
  EXPECT_EQ(right[1], 1500);
  EXPECT_EQ(right[3], 1500);
  const auto down = channels.flying({0, 2, 0}, 0.5, true);
  EXPECT_GT(down[1], 1500) << "nose down: the stick forward";
  const auto left = channels.flying({0, 0, 2}, 0.5, true);
  EXPECT_LT(left[3], 1500) << "turning left";
  EXPECT_EQ(left[2], 1525) << "throttle half way from min_check";
}

TEST(BetaflightChannels, WhatIsSentIsUnderstoodAsItWasMeant) {
  const Channels channels(settings(), {});
  const Eigen::Vector3d rates(-4.2, 1.7, 0.8);
  const auto understood = channels.understood(channels.flying(rates, 0.37, true));
  EXPECT_LT((understood.body_rates_rad_s - rates).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_NEAR(understood.throttle, 0.37, 0.001);
}

TEST(BetaflightChannels, TheOrderIsTheReceivers) {
  Settings taer = settings();
  taer.map = {1, 2, 3, 0, 4, 6, 5, 7};  // TAER, and AUX2 and AUX3 the other way round
  Options options;
  options.arm_aux = 2;
  const Channels channels(taer, options);
  const auto pulses = channels.flying({2, 0, 0}, 1.0, true);
  EXPECT_EQ(pulses[0], 2000);
  EXPECT_GT(pulses[1], 1500);
  EXPECT_EQ(pulses[6], 1900) << "arms";
  EXPECT_EQ(pulses[5], 1000);
}

TEST(BetaflightChannels, OnlyArmingSwitchesTheArmSwitch) {
  const Channels channels(settings(), {});
  EXPECT_EQ(channels.flying({0, 0, 0}, 0.5, false)[4], 1000);
  EXPECT_EQ(channels.flying({0, 0, 0}, 0.5, true)[4], 1900);
  for (std::size_t i = 5; i < msp::kMaxChannels; ++i) EXPECT_EQ(channels.standing(true)[i], 1000);
}

TEST(BetaflightChannels, StandingIsStickInTheMiddleAndThrottleDown) {
  const Channels channels(settings(), {});
  const auto pulses = channels.standing(false);
  EXPECT_EQ(pulses[0], 1500);
  EXPECT_EQ(pulses[1], 1500);
  EXPECT_EQ(pulses[2], 1000);
  EXPECT_EQ(pulses[3], 1500);
  EXPECT_EQ(pulses[4], 1000);
}

TEST(BetaflightChannels, AReversedYawStickIsTurned) {
  Options options;
  options.yaw_reversed = true;
  const Channels channels(settings(), options);
  EXPECT_GT(channels.flying({0, 0, 2}, 0.5, true)[3], 1500);
  EXPECT_NEAR(channels.understood(channels.flying({0, 0, 2}, 0.5, true)).body_rates_rad_s.z(), 2.0, 0.02);
}

TEST(BetaflightChannels, EveryPulseIsValidWhateverIsAskedFor) {
  const Channels channels(settings(), {});
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const double rate : {-1e9, -20.0, 0.0, 20.0, 1e9, kNan, std::numeric_limits<double>::infinity()})
    for (const double throttle : {-5.0, 0.0, 1.0, 7.0, kNan})
      for (const std::uint16_t pulse : channels.flying({rate, rate, rate}, throttle, true)) {
        EXPECT_GE(pulse, 1000);
        EXPECT_LE(pulse, 2000);
      }
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
