// PX4's messages as bytes against files that were made without our code (golden.py): what goes to PX4 as it is written,
// what comes from it as it is read, and that other sizes are refused.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/dds/px4/convert.h"
#include "common/dds/px4/wire_type.h"
#include "gatefield_idl/px4PubSubTypes.h"
#include "tests/support/wire_bytes.h"

namespace gatefield::px4 {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr std::uint64_t kStamp_us = 1'800'000'000'000'000;

template <typename Generated, typename Message>
void expect_written(const Message& message, const std::string& name) {
  typename Generated::type sample;
  to_wire(message, &sample);
  WireType<Generated, Message> type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(&sample)());
  ASSERT_TRUE(type.serialize(&sample, &payload));
  EXPECT_EQ(std::vector<std::uint8_t>(payload.data, payload.data + payload.length), test::wire_bytes(name));
}

template <typename Generated, typename Message>
bool reads(const std::vector<std::uint8_t>& bytes, Message* message) {
  WireType<Generated, Message> type;
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  typename Generated::type sample;
  if (!type.deserialize(&payload, &sample)) return false;
  *message = from_wire(sample);
  return true;
}

/// Also padded to whole words, as RTPS does, and never a word shorter or longer.
template <typename Generated, typename Message>
Message read(const std::string& name) {
  std::vector<std::uint8_t> bytes = test::wire_bytes(name);
  Message message;
  EXPECT_TRUE((reads<Generated>(bytes, &message))) << name;
  EXPECT_TRUE(validate(message).ok()) << validate(message).error();
  Message other;
  auto longer = bytes;
  longer.resize((bytes.size() + 3) / 4 * 4);
  EXPECT_TRUE((reads<Generated>(longer, &other))) << name;
  longer.resize(bytes.size() + 4);
  EXPECT_FALSE((reads<Generated>(longer, &other))) << name;
  bytes.pop_back();
  EXPECT_FALSE((reads<Generated>(bytes, &other))) << name;
  return message;
}

TEST(Px4Golden, WhatGoesToPx4) {
  OffboardControlMode mode;
  mode.body_rate = true;
  expect_written<wire::OffboardControlMode_PubSubType>(mode, "px4_offboard_control_mode");
  expect_written<wire::VehicleRatesSetpoint_PubSubType>(
      VehicleRatesSetpoint{0, 1.5F, -2.5F, 0.25F, {0, 0, -0.75F}, false}, "px4_vehicle_rates_setpoint");
  VehicleCommand command;
  command.param1 = 1;
  command.param2 = 6;
  command.command = 176;
  command.target_system = 3;
  command.target_component = command.source_system = 1;
  command.source_component = 191;
  command.confirmation = 2;
  expect_written<wire::VehicleCommand_PubSubType>(command, "px4_vehicle_command");
}

TEST(Px4Golden, Acknowledgement) {
  EXPECT_EQ((read<wire::VehicleCommandAck_PubSubType, VehicleCommandAck>("px4_vehicle_command_ack")),
            (VehicleCommandAck{kStamp_us, 400, 1, 7, -5, 1, 191, true}));
}

TEST(Px4Golden, Odometry) {
  VehicleOdometry expected;
  expected.timestamp = kStamp_us;
  expected.timestamp_sample = kStamp_us - 3000;
  expected.position = {1.5F, -2.5F, 3.5F};
  expected.q = {0.5F, -0.5F, 0.5F, 0.5F};
  expected.velocity_frame = 3;
  expected.velocity = {4.5F, 5.5F, -6.5F};
  expected.angular_velocity = {0.25F, -0.5F, 0.75F};
  expected.position_variance = {0.125F, 0.25F, 0.5F};
  expected.orientation_variance = {1, 2, 4};
  expected.velocity_variance = {8, 16, 32};
  expected.reset_counter = 9;
  expected.quality = -1;
  EXPECT_EQ((read<wire::VehicleOdometry_PubSubType, VehicleOdometry>("px4_vehicle_odometry")), expected);
}

TEST(Px4Golden, StatusOfEachRelease) {
  const VehicleStatus expected{kStamp_us, kArmed, kNavOffboard, true, false, 7, 1, true};
  EXPECT_EQ((read<wire::VehicleStatusV0_PubSubType, VehicleStatus>("px4_vehicle_status_v0")), expected);
  EXPECT_EQ((read<wire::VehicleStatusV1_PubSubType, VehicleStatus>("px4_vehicle_status_v1")), expected);
  EXPECT_EQ((read<wire::VehicleStatusV4_PubSubType, VehicleStatus>("px4_vehicle_status_v4")), expected);
}

TEST(Px4Golden, LandDetectorSensorsAndTime) {
  EXPECT_EQ((read<wire::VehicleLandDetected_PubSubType, VehicleLandDetected>("px4_vehicle_land_detected")),
            (VehicleLandDetected{kStamp_us, true, true, false}));
  EXPECT_EQ((read<wire::SensorCombined_PubSubType, SensorCombined>("px4_sensor_combined")),
            (SensorCombined{kStamp_us, {0.25F, -0.5F, 0.75F}, 20, {1.5F, -0.5F, -9.75F}}));
  EXPECT_EQ((read<wire::TimesyncStatus_PubSubType, TimesyncStatus>("px4_timesync_status")),
            (TimesyncStatus{kStamp_us, 2, kStamp_us + 7, -40'000, -39'500, 850}));
}

TEST(Px4Golden, SwitchesOfEachRelease) {
  const auto manual =
      read<wire::ManualControlSetpoint_PubSubType, ManualControlSetpoint>("px4_manual_control_setpoint");
  EXPECT_TRUE(manual.valid);
  EXPECT_EQ(manual.aux, (std::array<float, 6>{1, -1, 0.5F, 0, 0.125F, -0.5F}));
  InputRc expected{kStamp_us, 8, false, true, {}};
  for (std::size_t i = 0; i < expected.values.size(); ++i)
    expected.values[i] = static_cast<std::uint16_t>(1000 + 50 * i);
  EXPECT_EQ((read<wire::InputRc_PubSubType, InputRc>("px4_input_rc_plain")), expected);
  EXPECT_EQ((read<wire::InputRcWithFrameRate_PubSubType, InputRc>("px4_input_rc_with_frame_rate")), expected);
}

TEST(Px4Golden, BatteryOfEachRelease) {
  const BatteryStatus expected{kStamp_us, true, 15.75F};
  EXPECT_EQ((read<wire::BatteryStatusFiltered_PubSubType, BatteryStatus>("px4_battery_status_filtered")), expected);
  EXPECT_EQ((read<wire::BatteryStatusV0_PubSubType, BatteryStatus>("px4_battery_status_v0")), expected);
  EXPECT_EQ((read<wire::BatteryStatusV1_PubSubType, BatteryStatus>("px4_battery_status_v1")), expected);
}

TEST(Px4Golden, TypesHavePx4sNames) {
  EXPECT_STREQ((WireType<wire::VehicleStatusV4_PubSubType, VehicleStatus>().getName()),
               "px4_msgs::msg::dds_::VehicleStatus_");
  EXPECT_STREQ((WireType<wire::InputRcWithFrameRate_PubSubType, InputRc>().getName()), "px4_msgs::msg::dds_::InputRc_");
  EXPECT_STREQ((WireType<wire::TimesyncStatus_PubSubType, TimesyncStatus>().getName()),
               "px4_msgs::msg::dds_::TimesyncStatus_");
}

TEST(Px4Golden, ABoolThatIsNoneIsRefused) {
  std::vector<std::uint8_t> bytes = test::wire_bytes("px4_vehicle_land_detected");
  bytes[4 + 8] = 2;
  VehicleLandDetected message;
  EXPECT_FALSE((reads<wire::VehicleLandDetected_PubSubType>(bytes, &message)));
}

}  // namespace
}  // namespace gatefield::px4
