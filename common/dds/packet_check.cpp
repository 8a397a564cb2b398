#include "common/dds/packet_check.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace gatefield::dds {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kHeader_bytes = 20, kSubmessageHeader_bytes = 4;
constexpr std::array<std::uint8_t, 2> kEprosima{0x01, 0x0f};
constexpr std::size_t kStatistics_bytes = 56;
constexpr std::uint32_t kMaxBits = 256;

// Kinds of submessages (9.4.5.1.1).
constexpr std::uint8_t kPad = 0x01, kAckNack = 0x06, kHeartbeat = 0x07, kGap = 0x08, kInfoTimestamp = 0x09,
                       kInfoSource = 0x0c, kInfoDestination = 0x0e, kNackFrag = 0x12, kHeartbeatFrag = 0x13,
                       kData = 0x15, kDataFrag = 0x16, kStatistics = 0x80;
// Flags.
constexpr std::uint8_t kLittleEndian = 1, kInlineQos = 2, kDataFlag = 4, kKeyFlag = 8, kFragKeyFlag = 4,
                       kNoTimestamp = 2;
// Parameters (9.6.2.2.2).
constexpr std::uint16_t kSentinel = 1, kContentFilterInfo = 0x55, kStatusInfo = 0x71;
constexpr std::uint8_t kDisposedOrUnregistered = 3;  // of the status, in its last byte

/// Fields one after the other, in the byte order of their submessage. Beyond the end all is 0, and ok() is false.
class Fields {
 public:
  Fields(Bytes bytes, bool little_endian) : bytes_(bytes), little_endian_(little_endian) {}

  bool ok() const noexcept { return ok_; }
  std::size_t position() const noexcept { return position_; }
  std::size_t left() const noexcept { return ok_ ? bytes_.size() - position_ : 0; }
  void skip(std::size_t bytes) noexcept {
    if (bytes > left()) {
      ok_ = false;
      return;
    }
    position_ += bytes;
  }
  std::uint16_t u16() noexcept { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() noexcept { return number(4); }
  /// The high word comes first, in either byte order (9.4.2.5).
  std::int64_t sequence() noexcept {
    const auto high = static_cast<std::int32_t>(u32());
    const std::uint32_t low = u32();
    return static_cast<std::int64_t>(high) * (std::int64_t{1} << 32) + static_cast<std::int64_t>(low);
  }
  /// A set's bits after its base: how many there are, at most kMaxBits, with as many words as they take.
  bool bits() noexcept {
    const std::uint32_t count = u32();
    if (count > kMaxBits) return false;
    skip(std::size_t{4} * ((count + 31) / 32));
    return true;
  }
  Bytes rest() const noexcept { return bytes_.subspan(std::min(position_, bytes_.size())); }

 private:
  std::uint32_t number(std::size_t bytes) noexcept {
    if (bytes > left()) {
      ok_ = false;
      return 0;
    }
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t shift = 8 * (little_endian_ ? i : bytes - 1 - i);
      value |= std::uint32_t{bytes_[position_ + i]} << shift;
    }
    position_ += bytes;
    return value;
  }

  Bytes bytes_;
  bool little_endian_;
  bool ok_ = true;
  std::size_t position_ = 0;
};

bool is_sequence(std::int64_t number) noexcept { return number >= 1 && number <= kMaxSequence; }

/// Goes behind the sentinel of a list of parameters (9.4.2.11). @return false: it has none
/// @param see  called with each parameter's number and value
template <typename See>
bool skip_parameters(Fields* list, See&& see) noexcept {
  while (true) {
    const std::uint16_t id = list->u16(), bytes = list->u16();
    if (!list->ok()) return false;
    if (id == kSentinel) return true;
    if (bytes % 4 != 0 || bytes > list->left()) return false;
    see(id, list->rest().first(bytes));
    list->skip(bytes);
  }
}
bool skip_parameters(Fields* list) noexcept {
  return skip_parameters(list, [](std::uint16_t, Bytes) {});
}

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
  Fields list(payload.subspan(4), encapsulation == 3);
  return skip_parameters(&list) ? PacketFault::kNone : PacketFault::kParameters;
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
  return (flags & kDataFlag) != 0 && is_builtin(writer, little_endian) ? check_discovery(fields.rest())
                                                                       : PacketFault::kNone;
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

/// @param said         the length in the submessage's header
/// @param participant  the datagram's
PacketFault check_submessage(std::uint8_t id, std::uint8_t flags, Bytes body, std::size_t said, Bytes participant,
                             std::uint32_t* fragmented_bytes) noexcept {
  const Fields fields(body, (flags & kLittleEndian) != 0);
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
    if (datagram.size() - at < kSubmessageHeader_bytes) return wrong(PacketFault::kCut);
    const std::uint8_t id = datagram[at], flags = datagram[at + 1];
    Fields header(datagram.subspan(at + 2, 2), (flags & kLittleEndian) != 0);
    const std::size_t said = header.u16();
    const std::size_t begin = at + kSubmessageHeader_bytes, left = datagram.size() - begin;
    // A length of 0 reaches to the datagram's end, but for the two kinds that may be empty (9.4.5.1.3).
    const std::size_t length = said == 0 && id != kInfoTimestamp && id != kPad ? left : said;
    // The library goes on at the next multiple of 4; only the last may end elsewhere.
    if (length > left || (length < left && length % 4 != 0)) return wrong(PacketFault::kCut, id);
    if (id == kStatistics && eprosima)
      return said == kStatistics_bytes && length == left ? PacketVerdict{PacketFault::kNone, 0, at, fragmented_bytes}
                                                         : wrong(PacketFault::kVendor, id);
    const PacketFault fault =
        check_submessage(id, flags, datagram.subspan(begin, length), said, datagram.subspan(8, 12), &fragmented_bytes);
    if (fault != PacketFault::kNone) return wrong(fault, id);
    at = begin + length;
  }
  return {PacketFault::kNone, 0, datagram.size(), fragmented_bytes};
}

}  // namespace gatefield::dds
