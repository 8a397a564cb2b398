#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

/// What may come in from a network that nobody trusts, before the DDS library reads it.
namespace gatefield::dds {

/// What is wrong with a datagram.
enum class PacketFault : std::uint8_t {
  kNone,
  kHeader,      ///< no RTPS message of major version 2
  kCut,         ///< a submessage's header or its length goes beyond the datagram, or leaves the next one unaligned
  kTooShort,    ///< a submessage is shorter than its fields
  kVendor,      ///< a vendor's submessage that the library would take for its own
  kSequence,    ///< a sequence number below 1 or beyond kMaxSequence
  kRange,       ///< a set or range of sequence numbers that is turned round, or wider than the library can bear
  kFragment,    ///< fragments that don't fit their sample, or a sample beyond kMaxSample_bytes
  kParameters,  ///< a list of parameters without an end, or one that goes beyond its submessage
  kFlags,       ///< flags that exclude each other
  kSource,      ///< it goes on in another participant's name
  kFilter,      ///< it says what a reader's own filter would
  kKey,         ///< a key alone that disposes of nothing
  kToken,       ///< a token or handshake of DDS security that says more than it has
  // Of a domain that is closed to strangers (ClosedDomain):
  kUnprotected,   ///< what must be encrypted, for this receiver, and is not
  kAnnouncement,  ///< another participant's announcement, or its goodbye, that anybody could write
  // Not by the packet alone:
  kUnread,    ///< the library gave up on it
  kStranger,  ///< fragments of a large sample of somebody who has no business with one
};
/// How many there are, kNone included.
inline constexpr std::size_t kPacketFaults = 18;
/// What is wrong, for people: "a submessage is shorter than its fields".
std::string_view sentence(PacketFault fault) noexcept;

struct PacketVerdict {
  PacketFault fault = PacketFault::kNone;
  std::uint8_t submessage = 0;  ///< id of the one at fault; 0: the header's
  /// What of the datagram the library may read. Shorter than the datagram by the submessage of statistics (0x80) that
  /// Fast DDS puts at the end of what it sends: reading one asserts what its sender says.
  std::size_t size = 0;
  /// The largest sample that it has fragments of, but for those of discovery; 0: no fragments.
  std::uint32_t fragmented_bytes = 0;
};

/// No writer of ours comes near: a thousand samples a second for nine thousand years.
inline constexpr std::int64_t kMaxSequence = std::int64_t{1} << 48;
/// A reader walks through a gap number by number, and keeps each that doesn't follow on (CVE-2025-64438).
inline constexpr std::int64_t kMaxGap = 65'536;
/// Numbers between first and last of a HEARTBEAT.
inline constexpr std::int64_t kMaxHeartbeatSpan = 16'777'216;
/// The largest sample of docs/wire.md (a depth frame) with room for its header: a first fragment makes the library
/// allocate what it says.
inline constexpr std::uint32_t kMaxSample_bytes = 6'553'600 + 4'096;

/// Reads a datagram as RTPS 2 (OMG DDSI-RTPS 2.3, 8.3 and 9.4) and says whether the library may have it: header, each
/// submessage's kind and length, sequence numbers, sets and ranges, fragments, lists of parameters, of inline QoS and
/// of discovery. Submessages that the standard does not name pass, as it wants, but for those that the library reads as
/// its own. What security has encrypted is seen by its outer form only.
///
/// A datagram speaks for one participant, the header's: an INFO_SRC of another one is refused. (Cyclone DDS may pack
/// what two participants of a process say into one datagram; what is reliable it sends again.)
/// Thread-safe: yes.   Real-time safe: yes (no allocation; time linear in the datagram).
PacketVerdict check_packet(std::span<const std::uint8_t> datagram) noexcept;

}  // namespace gatefield::dds
