#include "common/dds/packet_check.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "common/dds/packet_fields.h"
#include "common/dds/token_check.h"

namespace gatefield::dds {
namespace {

constexpr std::array<std::uint8_t, 2> kEprosima{0x01, 0x0f};
constexpr std::size_t kStatistics_bytes = 56;

bool is_sequence(std::int64_t number) noexcept { return number >= 1 && number <= kMaxSequence; }

/// Goes behind inline QoS. @param ends  whether it says that an instance is disposed of or unregistered
PacketFault check_inline_qos(Fields* list, bool* ends) noexcept {
  bool filters = false;
  const bool whole = skip_parameters(list, [&](std::uint16_t id, Bytes value) {
    filters |= id == kContentFilterInfo;
    *ends |= id == kStatusInfo && value.size() >= 4 && (value[3] & kDisposedOrUnregistered) != 0;
  });
  if (!whole) return PacketFault::kParameters;
  return filters ? PacketFault::kFilter : PacketFault::kNone;
}

/// The entity's two highest bits of its kind say that it is one of discovery (9.3.1.2).
bool is_builtin(std::uint32_t entity, bool little_endian) noexcept {
  const std::uint32_t kind = little_endian ? entity >> 24 : entity & 0xff;
  return (kind & 0xc0) == 0xc0;
}

/// A payload of discovery is a list of parameters, by its encapsulation.
PacketFault check_discovery(Bytes payload) noexcept {
  if (payload.size() < 4) return PacketFault::kTooShort;
  const std::uint16_t encapsulation = static_cast<std::uint16_t>(payload[0] << 8 | payload[1]);
  if (encapsulation != 2 && encapsulation != 3) return PacketFault::kNone;
  const bool little_endian = encapsulation == 3;
  Fields list(payload.subspan(4), little_endian);
  bool tokens = true;
  const bool whole = skip_parameters(&list, [&](std::uint16_t id, Bytes value) {
    // The library makes room for as many properties as a token says, whether security is on or not.
    if (id == kIdentityToken || id == kPermissionsToken) tokens &= check_token(value, little_endian);
  });
  if (!whole) return PacketFault::kParameters;
  return tokens ? PacketFault::kNone : PacketFault::kToken;
}

PacketFault check_data(Bytes body, std::uint8_t flags) noexcept {
  const bool little_endian = (flags & kLittleEndian) != 0;
  if ((flags & kDataFlag) != 0 && (flags & kKeyFlag) != 0) return PacketFault::kFlags;
  Fields fields(body, little_endian);
  fields.skip(2);
  const std::uint16_t to_inline_qos = fields.u16();
  fields.skip(4);
  const std::uint32_t writer = fields.u32();
  const std::int64_t sequence = fields.sequence();
  if (!fields.ok() || to_inline_qos < 16) return PacketFault::kTooShort;
  if (!is_sequence(sequence)) return PacketFault::kSequence;
  fields.skip(to_inline_qos - 16u);
  if (!fields.ok()) return PacketFault::kTooShort;
  bool ends = false;
  if ((flags & kInlineQos) != 0)
    if (const PacketFault fault = check_inline_qos(&fields, &ends); fault != PacketFault::kNone) return fault;
  // The library would take a sample without its payload for one that is there.
  if ((flags & kDataFlag) == 0 && !ends) return PacketFault::kKey;
  if ((flags & (kDataFlag | kKeyFlag)) == 0) return PacketFault::kNone;
  if (fields.left() < 4) return PacketFault::kTooShort;
  if ((flags & kDataFlag) == 0 || !is_builtin(writer, little_endian)) return PacketFault::kNone;
  if (entity_at(body, 8) == kHandshakes)
    return check_handshake(fields.rest()) ? PacketFault::kNone : PacketFault::kToken;
  return check_discovery(fields.rest());
}

/// @param largest  becomes the sample's size where that is more, unless it is one of discovery
PacketFault check_data_frag(Bytes body, std::uint8_t flags, std::uint32_t* largest) noexcept {
  const bool little_endian = (flags & kLittleEndian) != 0;
  Fields fields(body, little_endian);
  fields.skip(2);
  const std::uint16_t to_inline_qos = fields.u16();
  fields.skip(4);
  const std::uint32_t writer = fields.u32();
  const std::int64_t sequence = fields.sequence();
  const std::uint64_t first = fields.u32(), count = fields.u16(), size = fields.u16(), sample = fields.u32();
  if (!fields.ok() || to_inline_qos < 28) return PacketFault::kTooShort;
  if (!is_sequence(sequence)) return PacketFault::kSequence;
  if (first < 1 || count < 1 || size < 1 || sample < 1 || sample > kMaxSample_bytes) return PacketFault::kFragment;
  const std::uint64_t begin = (first - 1) * size;
  // The last fragment may be shorter than the others, but there is something in it.
  if (begin + (count - 1) * size >= sample) return PacketFault::kFragment;
  if (!is_builtin(writer, little_endian)) *largest = std::max(*largest, static_cast<std::uint32_t>(sample));
  fields.skip(to_inline_qos - 28u);
  if (!fields.ok()) return PacketFault::kTooShort;
  bool ends = false;
  if ((flags & kInlineQos) != 0)
    if (const PacketFault fault = check_inline_qos(&fields, &ends); fault != PacketFault::kNone) return fault;
  if ((flags & kFragKeyFlag) != 0) return PacketFault::kNone;
  const std::uint64_t payload = std::min(count * size, sample - begin);
  // Padding to a multiple of 4 may follow.
  return fields.left() >= payload && fields.left() < payload + 4 ? PacketFault::kNone : PacketFault::kFragment;
}

PacketFault check_heartbeat(Fields fields) noexcept {
  fields.skip(8);
  const std::int64_t first = fields.sequence(), last = fields.sequence();
  fields.skip(4);
  if (!fields.ok()) return PacketFault::kTooShort;
  if (!is_sequence(first) || last > kMaxSequence) return PacketFault::kSequence;
  return last >= first - 1 && last - first <= kMaxHeartbeatSpan ? PacketFault::kNone : PacketFault::kRange;
}

PacketFault check_gap(Fields fields) noexcept {
  fields.skip(8);
  const std::int64_t first = fields.sequence(), base = fields.sequence();
  const bool bits = fields.bits();
  if (!fields.ok()) return PacketFault::kTooShort;
  if (!is_sequence(first) || !is_sequence(base)) return PacketFault::kSequence;
  return bits && base >= first && base - first <= kMaxGap ? PacketFault::kNone : PacketFault::kRange;
}

PacketFault check_acknack(Fields fields) noexcept {
  fields.skip(8);
  const std::int64_t base = fields.sequence();
  const bool bits = fields.bits();
  fields.skip(4);
  if (!fields.ok()) return PacketFault::kTooShort;
  // 0: a reader that has heard nothing yet
  if (base != 0 && !is_sequence(base)) return PacketFault::kSequence;
  return bits ? PacketFault::kNone : PacketFault::kRange;
}

PacketFault check_nack_frag(Fields fields) noexcept {
  fields.skip(8);
  const std::int64_t sequence = fields.sequence();
  const std::uint32_t base = fields.u32();
  const bool bits = fields.bits();
  fields.skip(4);
  if (!fields.ok()) return PacketFault::kTooShort;
  if (!is_sequence(sequence)) return PacketFault::kSequence;
  return bits && base >= 1 && base <= kMaxSample_bytes ? PacketFault::kNone : PacketFault::kRange;
}

PacketFault check_heartbeat_frag(Fields fields) noexcept {
  fields.skip(8);
  const std::int64_t sequence = fields.sequence();
  const std::uint32_t last = fields.u32();
  fields.skip(4);
  if (!fields.ok()) return PacketFault::kTooShort;
  if (!is_sequence(sequence)) return PacketFault::kSequence;
  return last >= 1 && last <= kMaxSample_bytes ? PacketFault::kNone : PacketFault::kRange;
}

/// @param body   must have 20 bytes, as in INFO_SRC: unused, version, vendor, participant
bool is_of(Bytes body, Bytes participant) noexcept {
  return std::equal(participant.begin(), participant.end(), body.begin() + 8);
}

/// @param participant  the datagram's
PacketFault check_submessage(const Submessage& submessage, Bytes participant,
                             std::uint32_t* fragmented_bytes) noexcept {
  const auto& [id, flags, said, body] = submessage;
  const Fields fields = submessage.fields();
  switch (id) {
    case kData:
      return check_data(body, flags);
    case kDataFrag:
      return check_data_frag(body, flags, fragmented_bytes);
    case kHeartbeat:
      return check_heartbeat(fields);
    case kGap:
      return check_gap(fields);
    case kAckNack:
      return check_acknack(fields);
    case kNackFrag:
      return check_nack_frag(fields);
    case kHeartbeatFrag:
      return check_heartbeat_frag(fields);
    case kInfoTimestamp:
      return said >= ((flags & kNoTimestamp) != 0 ? 0u : 8u) ? PacketFault::kNone : PacketFault::kTooShort;
    case kInfoDestination:
      return body.size() >= 12 ? PacketFault::kNone : PacketFault::kTooShort;
    case kInfoSource:
      if (body.size() < 20) return PacketFault::kTooShort;
      return is_of(body, participant) ? PacketFault::kNone : PacketFault::kSource;
    default:
      return PacketFault::kNone;
  }
}

}  // namespace

PacketVerdict check_packet(Bytes datagram) noexcept {
  const auto wrong = [](PacketFault fault, std::uint8_t submessage = 0) {
    return PacketVerdict{fault, submessage, 0, 0};
  };
  if (datagram.size() < kHeader_bytes || std::memcmp(datagram.data(), "RTPS", 4) != 0 || datagram[4] != 2)
    return wrong(PacketFault::kHeader);
  const bool eprosima = std::equal(kEprosima.begin(), kEprosima.end(), datagram.begin() + 6);

  std::uint32_t fragmented_bytes = 0;
  std::size_t at = kHeader_bytes;
  while (at < datagram.size()) {
    Submessage next;
    const std::size_t begin = at;
    if (!read_submessage(datagram, &at, &next)) return wrong(PacketFault::kCut, next.id);
    if (next.id == kStatistics && eprosima)
      return next.said == kStatistics_bytes && at == datagram.size()
                 ? PacketVerdict{PacketFault::kNone, 0, begin, fragmented_bytes}
                 : wrong(PacketFault::kVendor, next.id);
    const PacketFault fault = check_submessage(next, datagram.subspan(kSender_at, kSender_bytes), &fragmented_bytes);
    if (fault != PacketFault::kNone) return wrong(fault, next.id);
  }
  return {PacketFault::kNone, 0, datagram.size(), fragmented_bytes};
}

}  // namespace gatefield::dds
