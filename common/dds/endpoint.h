#pragma once

#include <cstdint>

/// What both ends of the wire share. No header of this folder shows a DDS type to its users: the service and the SDK
/// see protocol messages, handlers and results only.
namespace gatefield::dds {

/// The topics of docs/wire.md, for counters and sentences.
enum class Topic : std::uint8_t { kSessionRequest, kSessionReply, kVehicleState, kDepthFrame, kCommand, kTelemetry };

/// The topic's name on the wire, for example "gatefield/vehicle/state".
const char* topic_name(Topic topic) noexcept;

/// DDS domains have port numbers of their own; above this one they would pass 65535.
inline constexpr std::uint32_t kMaxDomain = 232;

struct TransportOptions {
  /// Depth frames kept for repair. 2 suits a LAN; take 8 when the round trip is longer than 10 ms.
  int depth_history = 2;
};

}  // namespace gatefield::dds
