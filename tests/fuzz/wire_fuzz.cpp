// libFuzzer over the samples of every topic: the first byte says which type the rest is read as. Reading comes back
// with a message or a sentence; a message that came through can be written, read again, and comes through again.

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "common/dds/convert.h"
#include "common/dds/px4/convert.h"
#include "common/dds/px4/wire_type.h"
#include "common/dds/record_convert.h"
#include "common/dds/request_type.h"
#include "common/dds/ros_convert.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "gatefield_idl/px4PubSubTypes.h"
#include "gatefield_idl/rosPubSubTypes.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/fuzz/wire_input.h"

namespace {

using namespace gatefield;
using eprosima::fastrtps::rtps::SerializedPayload_t;

[[noreturn]] void bug(const std::string& what) {
  std::cerr << what << '\n';
  std::abort();
}

void expect_words(const Status& verdict) {
  if (verdict.ok()) return;
  const std::string& words = verdict.error();
  if (words.empty() || words.size() > 2000) bug("a refusal without or with too many words");
  if (std::any_of(words.begin(), words.end(), [](char c) { return c >= 0 && c < ' '; }))
    bug("a refusal with control characters: " + words);
}

bool read_sample(eprosima::fastdds::dds::TopicDataType* type, const std::uint8_t* data, std::size_t size,
                 void* sample) {
  SerializedPayload_t payload(static_cast<std::uint32_t>(size));
  std::copy_n(data, size, payload.data);
  payload.length = static_cast<std::uint32_t>(size);
  return type->deserialize(&payload, sample);
}

/// @tparam Type  as the endpoints read it
template <typename Type, typename Message>
void both_ways(const std::uint8_t* data, std::size_t size) {
  static Type type;
  typename Type::type sample;
  if (!read_sample(&type, data, size, &sample)) return;
  Message message;
  const Status verdict = dds::from_wire(sample, &message);
  expect_words(verdict);
  if (!verdict.ok()) return;
  typename Type::type again;
  dds::to_wire(message, &again);
  SerializedPayload_t payload(type.getSerializedSizeProvider(&again)());
  if (!type.serialize(&again, &payload)) bug("what was read can't be written");
  typename Type::type read;
  if (!read_sample(&type, payload.data, payload.length, &read)) bug("what was written can't be read");
  Message same;
  if (const Status second = dds::from_wire(read, &same); !second.ok())
    bug("what was accepted is refused when it comes again: " + second.error());
}

/// Of a type whose data are taken out of the sample.
template <typename Type, typename Message>
void one_way(const std::uint8_t* data, std::size_t size) {
  static Type type;
  typename Type::type sample;
  if (!read_sample(&type, data, size, &sample)) return;
  Message message;
  expect_words(dds::from_wire(&sample, &message));
}

/// PX4's: validation is of the message.
template <typename Generated, typename Message>
void of_px4(const std::uint8_t* data, std::size_t size) {
  static px4::WireType<Generated, Message> type;
  typename Generated::type sample;
  if (!read_sample(&type, data, size, &sample)) return;
  const Message message = px4::from_wire(sample);
  expect_words(px4::validate(message));
}

namespace px4_wire = px4_msgs::msg::dds_;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::uint8_t* const bytes = data + 1;
  --size;
  switch (static_cast<fuzz::WireKind>(data[0] % fuzz::kWireKinds)) {
    case fuzz::WireKind::kSessionRequest:
      both_ways<dds::RequestType, protocol::SessionRequest>(bytes, size);
      break;
    case fuzz::WireKind::kSessionReply:
      both_ways<dds::WireType<wire::SessionReplyPubSubType>, protocol::SessionReply>(bytes, size);
      break;
    case fuzz::WireKind::kVehicleState:
      both_ways<dds::WireType<wire::VehicleStatePubSubType>, protocol::VehicleState>(bytes, size);
      break;
    case fuzz::WireKind::kDepthFrame:
      one_way<dds::WireType<wire::DepthFramePubSubType>, protocol::DepthFrame>(bytes, size);
      break;
    case fuzz::WireKind::kThrustRateCommand:
      both_ways<dds::WireType<wire::ThrustRateCommandPubSubType>, protocol::ThrustRateCommand>(bytes, size);
      break;
    case fuzz::WireKind::kTelemetry:
      both_ways<dds::WireType<wire::TelemetryPubSubType>, protocol::Telemetry>(bytes, size);
      break;
    case fuzz::WireKind::kRosOdometry:
      one_way<dds::WireType<nav_msgs::msg::dds_::Odometry_PubSubType>, ros::Odometry>(bytes, size);
      break;
    case fuzz::WireKind::kRosPose:
      one_way<dds::WireType<geometry_msgs::msg::dds_::PoseStamped_PubSubType>, ros::PoseStamped>(bytes, size);
      break;
    case fuzz::WireKind::kRosImage:
      one_way<dds::WireType<sensor_msgs::msg::dds_::Image_PubSubType>, ros::Image>(bytes, size);
      break;
    case fuzz::WireKind::kPx4Odometry:
      of_px4<px4_wire::VehicleOdometry_PubSubType, px4::VehicleOdometry>(bytes, size);
      break;
    case fuzz::WireKind::kPx4Acknowledgement:
      of_px4<px4_wire::VehicleCommandAck_PubSubType, px4::VehicleCommandAck>(bytes, size);
      break;
    case fuzz::WireKind::kPx4Status:
      of_px4<px4_wire::VehicleStatusV1_PubSubType, px4::VehicleStatus>(bytes, size);
      break;
    case fuzz::WireKind::kPx4Battery:
      of_px4<px4_wire::BatteryStatusV1_PubSubType, px4::BatteryStatus>(bytes, size);
      break;
    case fuzz::WireKind::kPx4Switches:
      of_px4<px4_wire::ManualControlSetpoint_PubSubType, px4::ManualControlSetpoint>(bytes, size);
      break;
    case fuzz::WireKind::kServerStatus:
      both_ways<dds::WireType<wire::ServerStatusPubSubType>, protocol::ServerStatus>(bytes, size);
      break;
    case fuzz::WireKind::kPilotRecord:
      both_ways<dds::WireType<wire::PilotRecordPubSubType>, protocol::PilotRecord>(bytes, size);
      break;
  }
  return 0;
}
