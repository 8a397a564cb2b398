#include "client/firmware/betaflight_sitl/packets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <vector>

namespace gatefield::firmware::betaflight_sitl {
namespace {

constexpr std::array kWires{Wire::kUntil2025, Wire::kSince2026};

double number(const std::array<std::uint8_t, kStateBytes>& packet, std::size_t i) {
  double value = 0.0;
  std::memcpy(&value, packet.data() + 8 * i, 8);
  return value;
}

State rolling() {
  State state;
  state.body_rates_rad_s = {1, 2, 3};
  state.specific_force_m_s2 = {0.5, -0.25, 9.81};
  state.q_WB = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  return state;
}

TEST(BetaflightSitlPackets, SignsAreThoseThatTheFirmwareWants) {
  const auto before = encode(rolling(), Wire::kUntil2025);
  const auto since = encode(rolling(), Wire::kSince2026);
  for (const auto& packet : {before, since}) {
    EXPECT_EQ(number(packet, 1), 1.0);
    EXPECT_EQ(number(packet, 2), -2.0);
    EXPECT_EQ(number(packet, 4), -0.5);
    EXPECT_EQ(number(packet, 5), 0.25);
    EXPECT_EQ(number(packet, 6), -9.81);
    EXPECT_EQ(number(packet, 0), number(encode(State{}, Wire::kUntil2025), 0)) << "time stands still";
    EXPECT_EQ(number(packet, 17), 101325.0);
  }
  EXPECT_EQ(number(before, 3), -3.0);
  EXPECT_EQ(number(since, 3), 3.0);
}

TEST(BetaflightSitlPackets, AttitudeIsThatOfAviationUntil2025) {
  State state;  // heading north, nose up by 0.2
  state.q_WB = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()) *
               Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY());
  const auto packet = encode(state, Wire::kUntil2025);
  EXPECT_NEAR(number(packet, 7), std::cos(0.1), 1e-12);
  EXPECT_NEAR(number(packet, 8), 0.0, 1e-12);
  EXPECT_NEAR(number(packet, 9), std::sin(0.1), 1e-12);
  EXPECT_NEAR(number(packet, 10), 0.0, 1e-12);
}

TEST(BetaflightSitlPackets, StampsAndChannelsAreReadAsTheyWereWritten) {
  EXPECT_EQ(read_stamp_s(encode(State{}, Wire::kUntil2025)), kConstantStamp_s);
  EXPECT_EQ(read_stamp_s(encode(State{}, Wire::kSince2026, 12.345)), 12.345);
  Channels channels{};
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i] = static_cast<std::uint16_t>(1000 + i);
  const auto packet = encode(channels);
  EXPECT_EQ(packet[8] | packet[9] << 8, 1000);
  EXPECT_EQ(read_channels(packet), channels);
  EXPECT_FALSE(read_channels(std::span(packet).first(39)).has_value());
}

TEST(BetaflightSitlPackets, StampedMotorsAreNoPlainOnesAndTheOtherWayRound) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const StampedMotors motors{{0.125, 0.25, 0.5, 1.0}, 100.001};
  for (const Wire wire : kWires) {
    const auto packet = encode(motors, wire);
    const auto read = read_stamped_motors(packet, wire);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->motors, motors.motors);
    EXPECT_EQ(read->stamp_s, motors.stamp_s);
    EXPECT_FALSE(read_motors(packet, wire).has_value());
    EXPECT_FALSE(read_stamped_motors(encode(motors.motors, wire), wire).has_value());
    EXPECT_FALSE(read_stamped_motors(encode(StampedMotors{{2, 0, 0, 0}, 1.0}, wire), wire).has_value());
    EXPECT_FALSE(read_stamped_motors(encode(StampedMotors{{}, kInfinity}, wire), wire).has_value());
  }
}

TEST(BetaflightSitlPackets, WhatIsWrittenIsRead) {
  for (const Wire wire : kWires) {
    const State state = rolling();
    const auto read = read_state(encode(state, wire), wire);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->body_rates_rad_s, state.body_rates_rad_s);
    EXPECT_EQ(read->specific_force_m_s2, state.specific_force_m_s2);
    EXPECT_LT(read->q_WB.angularDistance(state.q_WB), 1e-9);
    const Motors motors{0.125, 0.25, 0.5, 1.0};
    EXPECT_EQ(read_motors(encode(motors, wire), wire), motors);
  }
}

TEST(BetaflightSitlPackets, MotorsAreWhereTheirVersionHasThem) {
  const Motors motors{0.125, 0.25, 0.5, 1.0};  // rear right, front right, rear left, front left
  std::array<float, 4> sent{};
  std::memcpy(sent.data(), encode(motors, Wire::kUntil2025).data(), kMotorsBytes);
  EXPECT_EQ(sent, (std::array{0.25f, 0.5f, 1.0f, 0.125f}));
  std::memcpy(sent.data(), encode(motors, Wire::kSince2026).data(), kMotorsBytes);
  EXPECT_EQ(sent, (std::array{0.125f, 0.25f, 0.5f, 1.0f}));
}

TEST(BetaflightSitlPackets, OtherSizesAndImpossibleNumbersGiveNothing) {
  for (const Wire wire : kWires) {
    for (std::size_t size = 0; size < 2 * kStateBytes; ++size) {
      const std::vector<std::uint8_t> packet(size, 0);
      EXPECT_EQ(read_state(packet, wire).has_value(), size == kStateBytes) << size;
      EXPECT_EQ(read_motors(packet, wire).has_value(), size == kMotorsBytes) << size;
    }
    for (std::size_t i = 0; i < 18; ++i) {
      auto packet = encode(rolling(), wire);
      const double nan = std::nan("");
      std::memcpy(packet.data() + 8 * i, &nan, 8);
      EXPECT_FALSE(read_state(packet, wire).has_value()) << i;
    }
    for (std::size_t i = 0; i < 4; ++i)
      for (const double wrong : {-0.01, 1.01, std::nan(""), std::numeric_limits<double>::infinity()}) {
        Motors motors{0.5, 0.5, 0.5, 0.5};
        motors[i] = wrong;
        EXPECT_FALSE(read_motors(encode(motors, wire), wire).has_value()) << i << " " << wrong;
      }
  }
}

}  // namespace
}  // namespace gatefield::firmware::betaflight_sitl
