// Every wire type as bytes, both ways, against files that were made without our code (golden.py).

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "common/dds/convert.h"
#include "common/dds/record_convert.h"
#include "common/dds/request_type.h"
#include "common/dds/wire_type.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/support/messages.h"
#include "tests/support/wire_bytes.h"

namespace gatefield::dds {
namespace {

using eprosima::fastrtps::rtps::SerializedPayload_t;

template <typename Generated>
std::vector<std::uint8_t> bytes_of(typename Generated::type* sample) {
  WireType<Generated> type;
  SerializedPayload_t payload(type.getSerializedSizeProvider(sample)());
  EXPECT_TRUE(type.serialize(sample, &payload));
  return {payload.data, payload.data + payload.length};
}

template <typename Generated>
typename Generated::type sample_of(const std::vector<std::uint8_t>& bytes) {
  WireType<Generated> type;
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  typename Generated::type sample;
  EXPECT_TRUE(type.deserialize(&payload, &sample));
  return sample;
}

// Writing gives the golden bytes; reading them gives a message that passes validation and writes the same bytes again.
template <typename Generated, typename Message>
Message both_ways(const std::string& name, const Message& message) {
  const auto expected = test::wire_bytes(name);
  typename Generated::type sample;
  to_wire(message, &sample);
  EXPECT_EQ(bytes_of<Generated>(&sample), expected) << "written";

  Message read;
  const Status verdict = from_wire(sample_of<Generated>(expected), &read);
  EXPECT_TRUE(verdict.ok()) << verdict.error();
  typename Generated::type again;
  to_wire(read, &again);
  EXPECT_EQ(bytes_of<Generated>(&again), expected) << "read and written";
  return read;
}

TEST(Golden, SessionRequest) {
  protocol::SessionRequest request = test::good_request();
  request.camera.fx_px = 84.25;  // exact numbers instead of tangents
  request.camera.fy_px = 81.5;
  request.camera.X_BC = forward_camera_mount(0.0, {0.125, 0, 0.0625});
  const auto read = both_ways<wire::SessionRequestPubSubType>("session_request", request);
  EXPECT_EQ(read.course.waypoints[2].p_W, Eigen::Vector3d(-3, 0, 1.75));
  EXPECT_EQ(read.quadrotor.rotor_spin[2], -1);
  EXPECT_EQ(read.timing, protocol::Timing::kLockstep);
}

// Of a client of another version a server reads who it is and which version it speaks, enough for a refusal.
TEST(Golden, SessionRequestOfVersion1IsReadAsFarAsItIsTheSame) {
  const auto bytes = test::wire_bytes("session_request_version_1");
  RequestType type;
  SerializedPayload_t payload(static_cast<std::uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<std::uint32_t>(bytes.size());
  wire::SessionRequest sample;
  ASSERT_TRUE(type.deserialize(&payload, &sample));
  protocol::SessionRequest read;
  const Status verdict = from_wire(sample, &read);
  EXPECT_EQ(read.version, 1u);
  EXPECT_EQ(read.vehicle, "drone");
  EXPECT_EQ(read.request, 7u);
  ASSERT_FALSE(verdict.ok());
  EXPECT_EQ(verdict.failure().code, ErrorCode::kVersion);
  EXPECT_EQ(verdict.error(), "version is 1, expected 2 (the protocol version of this program)");
}

TEST(Golden, SessionReply) {
  const auto read = both_ways<wire::SessionReplyPubSubType>("session_reply", test::good_reply());
  EXPECT_EQ(read.model_hash, 0xfedcba9876543210u);
  EXPECT_TRUE(read.accepted);
  EXPECT_EQ(read.retry_after_s, 1.5);
  EXPECT_EQ(read.heir[11], 12);
}

TEST(Golden, VehicleState) {
  const auto read = both_ways<wire::VehicleStatePubSubType>("vehicle_state", test::good_state());
  EXPECT_EQ(read.state.q_WB.w(), 0.5);
  EXPECT_EQ(read.state.q_WB.y(), -0.5);
  EXPECT_FALSE(read.thrust_known);
}

TEST(Golden, DepthFrame) {
  const auto expected = test::wire_bytes("depth_frame");
  const auto frame = test::good_frame("drone", 1, 16, 16);
  wire::DepthFrame sample;
  header_to_wire(frame, &sample);
  sample.pixels() = frame.pixels;
  EXPECT_EQ(bytes_of<wire::DepthFramePubSubType>(&sample), expected);

  wire::DepthFrame received = sample_of<wire::DepthFramePubSubType>(expected);
  protocol::DepthFrame read;
  const Status verdict = from_wire(&received, &read);
  EXPECT_TRUE(verdict.ok()) << verdict.error();
  EXPECT_EQ(read.pixels, frame.pixels);
  EXPECT_EQ(read.stamp, frame.stamp);
}

TEST(Golden, ThrustRateCommand) {
  const auto read = both_ways<wire::ThrustRateCommandPubSubType>("thrust_rate_command", test::good_command());
  EXPECT_EQ(read.steps, 20);
  EXPECT_EQ(read.collective_thrust_n[19], 11 + 4 * 0.25 * 19);
}

TEST(Golden, Telemetry) {
  const auto read = both_ways<wire::TelemetryPubSubType>("telemetry", test::good_telemetry());
  EXPECT_EQ(read.deadlines_missed, 6u);
}

TEST(Golden, ServerStatus) {
  const auto read = both_ways<wire::ServerStatusPubSubType>("server_status", test::good_status());
  EXPECT_EQ(read.room_cores, 1.25);
  EXPECT_TRUE(read.accepts);
}

TEST(Golden, PilotRecord) {
  const auto read = both_ways<wire::PilotRecordPubSubType>("pilot_record", test::good_record());
  EXPECT_EQ(read.take_overs, 3u);
  EXPECT_EQ(read.pilot, std::vector<std::uint8_t>({0, 1, 2, 255}));
}

}  // namespace
}  // namespace gatefield::dds
