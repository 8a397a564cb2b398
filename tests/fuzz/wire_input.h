#pragma once

#include <cstdint>
#include <map>
#include <string>

/// What wire_fuzz reads: a byte for the type, then a sample of it as it came from the network.
namespace gatefield::fuzz {

enum class WireKind : std::uint8_t {
  kSessionRequest,
  kSessionReply,
  kVehicleState,
  kDepthFrame,
  kThrustRateCommand,
  kTelemetry,
  kRosOdometry,
  kRosPose,
  kRosImage,
  kPx4Odometry,
  kPx4Acknowledgement,
  kPx4Status,
  kPx4Battery,
  kPx4Switches,
  kServerStatus,
  kPilotRecord,
};
inline constexpr std::uint8_t kWireKinds = 16;

/// The recorded sample of tests/data/wire that each begins with.
inline const std::map<std::string, WireKind> kWireSeeds{
    {"session_request", WireKind::kSessionRequest},
    {"session_request_version_1", WireKind::kSessionRequest},
    {"session_reply", WireKind::kSessionReply},
    {"vehicle_state", WireKind::kVehicleState},
    {"depth_frame", WireKind::kDepthFrame},
    {"thrust_rate_command", WireKind::kThrustRateCommand},
    {"telemetry", WireKind::kTelemetry},
    {"ros_odometry", WireKind::kRosOdometry},
    {"ros_pose_stamped", WireKind::kRosPose},
    {"ros_image", WireKind::kRosImage},
    {"px4_vehicle_odometry", WireKind::kPx4Odometry},
    {"px4_vehicle_command_ack", WireKind::kPx4Acknowledgement},
    {"px4_vehicle_status_v1", WireKind::kPx4Status},
    {"px4_battery_status_v1", WireKind::kPx4Battery},
    {"px4_manual_control_setpoint", WireKind::kPx4Switches},
    {"server_status", WireKind::kServerStatus},
    {"pilot_record", WireKind::kPilotRecord},
};

}  // namespace gatefield::fuzz
