#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "common/dds/network.h"
#include "common/dds/packet_check.h"
#include "common/dds/participant_id.h"
#include "common/dds/sample_fault.h"

/// What both ends of the wire share. No header of this folder shows a DDS type to its users: the service and the SDK
/// see protocol messages, handlers and results only.
namespace gatefield::dds {

/// The topics of docs/wire.md, for counters and sentences.
enum class Topic : std::uint8_t {
  kSessionRequest,
  kSessionReply,
  kVehicleState,
  kDepthFrame,
  kCommand,
  kTelemetry,
  kServerStatus,
  kPilotRecord,
};

/// The topic's name on the wire, for example "gatefield/vehicle/state".
const char* topic_name(Topic topic) noexcept;

/// DDS domains have port numbers of their own; above this one they would pass 65535.
inline constexpr std::uint32_t kMaxDomain = 232;

/// Packets that were dropped before the library read them.
struct DroppedPackets {
  std::uint64_t count = 0;                 ///< since this was told last
  PacketFault fault = PacketFault::kNone;  ///< of the newest
  std::uint8_t submessage = 0;             ///< id of its submessage at fault; 0: its header's
  std::string sender;                      ///< of the newest: "10.0.0.7:41234"
};

/// For people: "dropped 3 packets that no DDS participant sends, the last one from 10.0.0.7:41234, a submessage ..".
std::string in_words(const DroppedPackets& dropped);

/// Samples that a server did not take from whom they came.
struct DroppedSamples {
  std::uint64_t count = 0;  ///< since this was told last
  // Of the newest:
  SampleFault fault = SampleFault::kNone;
  Topic topic = Topic::kVehicleState;
  std::string vehicle;  ///< as it says; empty: an instance disposed of
  ParticipantId from;
};

/// For people: "dropped 3 samples of strangers, the last one a .. of "drone" from participant 01.0f..: ..".
std::string in_words(const DroppedSamples& dropped);

struct TransportOptions {
  NetworkOptions network;
  /// Depth frames kept for repair. 2 suits a LAN; take 8 when the round trip is longer than 10 ms.
  int depth_history = 2;
  /// Told of dropped packets, at most once a second; the last ones before the network falls silent may stay untold.
  /// Called on a thread of the middleware. May be empty.
  std::function<void(const DroppedPackets&)> on_packets_dropped;
  /// Called once when shared memory no longer brings anything, on a thread of its own: join anew.
  std::function<void()> on_deaf;
  /// Servers: as on_packets_dropped, of samples.
  std::function<void(const DroppedSamples&)> on_samples_dropped;
};

}  // namespace gatefield::dds
