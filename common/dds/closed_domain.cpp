#include "common/dds/closed_domain.h"

#include <algorithm>
#include <array>

#include "common/dds/packet_fields.h"
#include "common/dds/token_check.h"

namespace gatefield::dds {
namespace {

// Writers of discovery (DDSI-RTPS 9.3.1.5).
constexpr std::uint32_t kAnnouncements = 0x000100c2;
constexpr std::array<std::uint32_t, 3> kOpenDiscovery{0x000003c2, 0x000004c2, 0x000200c2};
// What an encrypted submessage begins and ends with (DDS security 9.5.2): of the first the key's number, of the last
// the proofs, each a key's number and a code, behind a code for everybody.
constexpr std::size_t kPrefix_bytes = 20, kKeyNumber_at = 4, kCode_bytes = 16, kProof_bytes = 20;

constexpr std::size_t kMaxAnnounced = 1024;
constexpr std::size_t kMaxHandshakes = 32;
constexpr Stamp kForgotten = std::chrono::seconds(5);  // beyond the lease of 3 s

/// How far the three parts of an encrypted submessage have come.
class Triple {
 public:
  bool open() const noexcept { return next_ != kSecPrefix; }
  /// @return false: another part has to come, or it proves nothing
  bool take(const Submessage& part) noexcept {
    if (part.id != next_) return false;
    switch (part.id) {
      case kSecPrefix:
        next_ = kSecBody;
        shared_ = part.body.size() == kPrefix_bytes &&
                  Fields(part.body.subspan(kKeyNumber_at, 4), false).u32() == 0;  // a key that two have alone
        return part.body.size() == kPrefix_bytes;
      case kSecBody: {
        next_ = kSecPostfix;
        Fields fields(part.body, false);
        return fields.u32() <= fields.left() && fields.ok();
      }
      default: {
        next_ = kSecPrefix;
        Fields fields(part.body, false);
        fields.skip(kCode_bytes);
        const std::uint32_t proofs = fields.u32();
        return fields.ok() && proofs <= fields.left() / kProof_bytes && (proofs > 0 || shared_);
      }
    }
  }

 private:
  std::uint8_t next_ = kSecPrefix;
  bool shared_ = false;
};

struct Data {
  std::uint32_t writer = 0;
  bool ends = false;  ///< of the instance
  Bytes payload;
};
/// @pre check_packet() has passed it
Data read_data(const Submessage& submessage) noexcept {
  Data data;
  Fields fields = submessage.fields();
  fields.skip(2);
  const std::uint16_t to_inline_qos = fields.u16();
  data.writer = entity_at(submessage.body, 8);
  fields.skip(to_inline_qos);
  if ((submessage.flags & kInlineQos) != 0)
    skip_parameters(&fields, [&](std::uint16_t id, Bytes value) {
      data.ends |= id == kStatusInfo && value.size() >= 4 && (value[3] & kDisposedOrUnregistered) != 0;
    });
  data.ends |= (submessage.flags & kDataFlag) == 0;
  data.payload = fields.rest();
  return data;
}

bool is_open_discovery(const Submessage& submessage) noexcept {
  const std::uint32_t writer = entity_at(submessage.body, 4);
  return std::find(kOpenDiscovery.begin(), kOpenDiscovery.end(), writer) != kOpenDiscovery.end();
}

/// The oldest one's place, when there is one free or nobody has heard of the oldest for long.
template <typename Entry>
Entry* place(std::vector<Entry>* entries, std::size_t most, Stamp now, Stamp forgotten) {
  if (entries->size() < most) return &entries->emplace_back();
  const auto oldest = std::min_element(entries->begin(), entries->end(),
                                       [](const Entry& a, const Entry& b) { return a.heard < b.heard; });
  if (now - oldest->heard < forgotten) return nullptr;
  *oldest = {};
  return &*oldest;
}

}  // namespace

PacketFault ClosedDomain::announced(const ParticipantId& who, Bytes words, Stamp now) {
  const std::lock_guard lock(mutex_);
  const auto known =
      std::find_if(announced_.begin(), announced_.end(), [&](const Announced& one) { return one.who == who; });
  if (known != announced_.end() && now - known->heard < kForgotten) {
    if (!std::equal(words.begin(), words.end(), known->words.begin(), known->words.end()))
      return PacketFault::kAnnouncement;
    known->heard = now;
    return PacketFault::kNone;
  }
  Announced* const fresh = known != announced_.end() ? &*known : place(&announced_, kMaxAnnounced, now, kForgotten);
  if (fresh == nullptr) return PacketFault::kAnnouncement;
  *fresh = {who, now, {words.begin(), words.end()}};
  return PacketFault::kNone;
}

/// Makes a datagram of the handshake once all of its fragments are there.
PacketFault ClosedDomain::take_fragments(const ParticipantId& who, Bytes body, std::uint8_t flags, Stamp now,
                                         std::vector<std::uint8_t>* whole) {
  Fields fields(body, (flags & kLittleEndian) != 0);
  fields.skip(2);
  const std::size_t to_inline_qos = fields.u16();
  fields.skip(8);
  const std::int64_t sequence = fields.sequence();
  const std::size_t first = fields.u32(), count = fields.u16(), size = fields.u16(), sample = fields.u32();
  if (sample > kMaxHandshake_bytes || size < 64 || (flags & kFragKeyFlag) != 0) return PacketFault::kToken;
  fields.skip(to_inline_qos - 28);
  if ((flags & kInlineQos) != 0) skip_parameters(&fields, [](std::uint16_t, Bytes) {});

  const std::lock_guard lock(mutex_);
  auto begun = std::find_if(handshakes_.begin(), handshakes_.end(),
                            [&](const Handshake& one) { return one.who == who && one.sequence == sequence; });
  if (begun == handshakes_.end() || begun->bytes.size() != sample) {
    Handshake* const fresh = place(&handshakes_, kMaxHandshakes, now, Stamp{0});
    *fresh = {who, sequence, now, std::vector<std::uint8_t>(sample), std::vector<bool>((sample + size - 1) / size)};
    begun = handshakes_.begin() + (fresh - handshakes_.data());
  }
  begun->heard = now;
  if (begun->there.size() != (sample + size - 1) / size) return PacketFault::kFragment;
  const std::size_t at = (first - 1) * size;
  const Bytes payload = fields.rest().first(std::min(count * size, sample - at));
  std::copy(payload.begin(), payload.end(), begun->bytes.begin() + static_cast<std::ptrdiff_t>(at));
  for (std::size_t i = first - 1; i < first - 1 + count; ++i) begun->there[i] = true;
  if (std::find(begun->there.begin(), begun->there.end(), false) != begun->there.end()) return PacketFault::kNone;

  const std::vector<std::uint8_t> message = std::move(begun->bytes);
  handshakes_.erase(begun);
  if (!check_handshake(message)) return PacketFault::kToken;
  // A DATA without inline QoS that reaches to the end, with reader, writer and number as in the fragments.
  constexpr std::array<std::uint8_t, 4> kBigEndianOffset{0, 0, 0, 16}, kLittleEndianOffset{0, 0, 16, 0};
  const auto& offset = (flags & kLittleEndian) != 0 ? kLittleEndianOffset : kBigEndianOffset;
  const std::uint8_t data_flags = static_cast<std::uint8_t>((flags & kLittleEndian) | kDataFlag);
  whole->insert(whole->end(), {kData, data_flags, 0, 0});
  whole->insert(whole->end(), offset.begin(), offset.end());
  whole->insert(whole->end(), body.begin() + 4, body.begin() + 20);
  whole->insert(whole->end(), message.begin(), message.end());
  return PacketFault::kNone;
}

ClosedDomain::Verdict ClosedDomain::check(Bytes datagram, Stamp now, Bytes* pass, std::vector<std::uint8_t>* whole) {
  ParticipantId who;
  std::copy_n(datagram.begin() + kSender_at, who.bytes.size(), who.bytes.begin());
  *pass = datagram;
  Triple encrypted;
  bool handshake = false;
  std::size_t header = kHeader_bytes;  // with what says for whom the handshake is
  std::size_t at = kHeader_bytes;
  while (at < datagram.size()) {
    Submessage next;
    const std::size_t begin = at;
    const auto wrong = [&next](PacketFault fault) { return Verdict{fault, next.id, false}; };
    if (!read_submessage(datagram, &at, &next)) return wrong(PacketFault::kCut);
    if (encrypted.open() || next.id == kSecPrefix) {
      if (!encrypted.take(next)) return wrong(PacketFault::kUnprotected);
      continue;
    }
    switch (next.id) {
      case kPad:
      case kInfoTimestamp:
      case kInfoSource:
      case kInfoDestination:
        if (begin == header) header = at;
        break;
      case kHeartbeat:
      case kAckNack:
      case kGap:
        if (!is_open_discovery(next)) return wrong(PacketFault::kUnprotected);
        break;
      case kData: {
        const Data data = read_data(next);
        if (data.writer == kAnnouncements) {
          if (data.ends) return wrong(PacketFault::kAnnouncement);
          if (const auto fault = announced(who, data.payload, now); fault != PacketFault::kNone) return wrong(fault);
        } else if (data.writer != kHandshakes || data.ends) {  // check_packet() has read a handshake
          return wrong(PacketFault::kUnprotected);
        }
        break;
      }
      case kDataFrag: {
        if (entity_at(next.body, 8) != kHandshakes || handshake || at != datagram.size())
          return wrong(PacketFault::kUnprotected);
        handshake = true;
        whole->assign(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(header));
        const auto fault = take_fragments(who, next.body, next.flags, now, whole);
        if (fault != PacketFault::kNone) return wrong(fault);
        break;
      }
      default:
        return wrong(PacketFault::kUnprotected);
    }
  }
  if (encrypted.open()) return {PacketFault::kUnprotected, kSecPrefix, false};
  if (!handshake) return {};
  *pass = *whole;
  return {PacketFault::kNone, 0, whole->size() == header};
}

}  // namespace gatefield::dds
