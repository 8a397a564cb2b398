#include "client/bridge/mavlink/radio.h"

#include <gtest/gtest.h>

#include <array>

namespace gatefield::bridge {
namespace {

constexpr RadioSwitches kRadio{.arm = 1, .take_over = 2, .kill = 4, .threshold_us = 1600};

TEST(Radio, ASwitchIsOnFromItsThresholdUp) {
  const std::array<std::uint16_t, 4> channels{1600, 1599, 2000, 1601};
  const flight::PilotSwitches read = switches(kRadio, channels);
  EXPECT_TRUE(read.arm);
  EXPECT_FALSE(read.take_over);
  EXPECT_TRUE(read.kill);
}

TEST(Radio, ChannelsThatAreNotThereAreOff) {
  const std::array<std::uint16_t, 2> channels{0xFFFF, 0};
  const flight::PilotSwitches read = switches(kRadio, channels);
  EXPECT_FALSE(read.arm || read.take_over || read.kill);
  const flight::PilotSwitches none = switches({}, std::array<std::uint16_t, 1>{2000});
  EXPECT_FALSE(none.arm || none.take_over || none.kill);
}

TEST(Radio, ChannelsBeyondTheRadioAreRefused) {
  EXPECT_TRUE(validate(kRadio, 4).ok());
  EXPECT_EQ(validate(kRadio, 3).failure().field, "radio.kill");
}

}  // namespace
}  // namespace gatefield::bridge
