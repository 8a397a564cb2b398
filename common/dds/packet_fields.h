#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

/// How RTPS 2 (OMG DDSI-RTPS 2.3) writes what it sends. Inside common/dds only.
namespace gatefield::dds {

using Bytes = std::span<const std::uint8_t>;

inline constexpr std::size_t kHeader_bytes = 20, kSubmessageHeader_bytes = 4;
inline constexpr std::size_t kSender_at = 8, kSender_bytes = 12;  ///< of the header: whose datagram it is

inline constexpr std::uint32_t kMaxBits = 256;  ///< of a set of numbers

// Kinds of submessages (9.4.5.1.1).
inline constexpr std::uint8_t kPad = 0x01, kAckNack = 0x06, kHeartbeat = 0x07, kGap = 0x08, kInfoTimestamp = 0x09,
                              kInfoSource = 0x0c, kInfoDestination = 0x0e, kNackFrag = 0x12, kHeartbeatFrag = 0x13,
                              kData = 0x15, kDataFrag = 0x16, kSecBody = 0x30, kSecPrefix = 0x31, kSecPostfix = 0x32,
                              kStatistics = 0x80;
// Flags.
inline constexpr std::uint8_t kLittleEndian = 1, kInlineQos = 2, kDataFlag = 4, kKeyFlag = 8, kFragKeyFlag = 4,
                              kNoTimestamp = 2;
// Parameters (9.6.2.2.2).
inline constexpr std::uint16_t kSentinel = 1, kContentFilterInfo = 0x55, kParticipant = 0x50, kStatusInfo = 0x71,
                               kIdentityToken = 0x1001, kPermissionsToken = 0x1002;
inline constexpr std::uint8_t kDisposedOrUnregistered = 3;  // of the status, in its last byte

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

/// An entity: four bytes in the order in which they are written down, whatever the byte order.
inline std::uint32_t entity_at(Bytes body, std::size_t at) noexcept {
  return body.size() < at + 4 ? 0 : Fields(body.subspan(at, 4), false).u32();
}
/// The writer of what makes a participant known to another (DDS security 1.1, 7.4.3).
inline constexpr std::uint32_t kHandshakes = 0x000201c3;

struct Submessage {
  std::uint8_t id = 0, flags = 0;
  std::size_t said = 0;  ///< the length in its header
  Bytes body;
  bool little_endian() const noexcept { return (flags & kLittleEndian) != 0; }
  Fields fields() const noexcept { return {body, little_endian()}; }
};
/// Reads the submessage at `at`, and puts `at` behind it.
/// @return false: it goes beyond the datagram, or leaves the next one unaligned; its id is there where it has one
inline bool read_submessage(Bytes datagram, std::size_t* at, Submessage* out) noexcept {
  if (datagram.size() - *at < kSubmessageHeader_bytes) return false;
  out->id = datagram[*at];
  out->flags = datagram[*at + 1];
  out->said = Fields(datagram.subspan(*at + 2, 2), out->little_endian()).u16();
  const std::size_t begin = *at + kSubmessageHeader_bytes, left = datagram.size() - begin;
  // A length of 0 reaches to the datagram's end, but for the two kinds that may be empty (9.4.5.1.3).
  const std::size_t length = out->said == 0 && out->id != kInfoTimestamp && out->id != kPad ? left : out->said;
  // The library goes on at the next multiple of 4; only the last may end elsewhere.
  if (length > left || (length < left && length % 4 != 0)) return false;
  out->body = datagram.subspan(begin, length);
  *at = begin + length;
  return true;
}

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

}  // namespace gatefield::dds
