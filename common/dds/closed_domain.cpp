#include "common/dds/closed_domain.h"

#include <algorithm>
#include <array>

#include "common/dds/announcements.h"

namespace gatefield::dds {
namespace {

// Other writers of discovery (DDSI-RTPS 9.3.1.5).
constexpr std::array<std::uint32_t, 3> kOpenDiscovery{0x000003c2, 0x000004c2, 0x000200c2};
// What an encrypted submessage begins and ends with (DDS security 9.5.2): of the first the key's number, of the last
// the proofs, each a key's number and a code, behind a code for everybody.
constexpr std::size_t kPrefix_bytes = 20, kKeyNumber_at = 4, kCode_bytes = 16, kProof_bytes = 20;

constexpr std::size_t kMaxAnnounced = 1024;
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
        const std::uint32_t length = fields.u32();
        return fields.ok() && length <= fields.left();
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

/// An announcement is of whose datagram it is in: the library goes by what it says itself.
bool is_of(const ParticipantId& who, Bytes words) noexcept {
  if (words.size() < 4) return false;
  bool said = false, own = true;
  Fields list(words.subspan(4), words[1] == 3);
  skip_parameters(&list, [&](std::uint16_t id, Bytes value) {
    if (id != kParticipant) return;
    said = true;
    own &= value.size() >= who.bytes.size() && std::equal(who.bytes.begin(), who.bytes.end(), value.begin());
  });
  return said && own;
}

bool is_open_discovery(const Submessage& submessage) noexcept {
  const std::uint32_t writer = entity_at(submessage.body, 4);
  return std::find(kOpenDiscovery.begin(), kOpenDiscovery.end(), writer) != kOpenDiscovery.end();
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
  const Announced fresh{who, now, {words.begin(), words.end()}};
  if (known != announced_.end()) {
    *known = fresh;
    return PacketFault::kNone;
  }
  if (announced_.size() >= kMaxAnnounced)
    std::erase_if(announced_, [now](const Announced& one) { return now - one.heard >= kForgotten; });
  if (announced_.size() >= kMaxAnnounced) return PacketFault::kAnnouncement;
  announced_.push_back(fresh);
  return PacketFault::kNone;
}

ClosedDomain::Verdict ClosedDomain::check(Bytes datagram, Stamp now) {
  ParticipantId who;
  std::copy_n(datagram.begin() + kSender_at, who.bytes.size(), who.bytes.begin());
  Triple encrypted;
  std::size_t at = kHeader_bytes;
  while (at < datagram.size()) {
    Submessage next;
    const auto wrong = [&next](PacketFault fault) { return Verdict{fault, next.id}; };
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
        break;
      case kHeartbeat:
      case kAckNack:
      case kGap:
        if (!is_open_discovery(next)) return wrong(PacketFault::kUnprotected);
        break;
      case kData: {
        const Data data = read_data(next);
        if (data.writer == kAnnouncements) {
          if (data.ends || !is_of(who, data.payload)) return wrong(PacketFault::kAnnouncement);
          if (const auto fault = announced(who, data.payload, now); fault != PacketFault::kNone) return wrong(fault);
        } else if (data.writer != kHandshakes || data.ends) {  // check_packet() has read a handshake
          return wrong(PacketFault::kUnprotected);
        }
        break;
      }
      default:
        return wrong(PacketFault::kUnprotected);
    }
  }
  return encrypted.open() ? Verdict{PacketFault::kUnprotected, kSecPrefix} : Verdict{};
}

}  // namespace gatefield::dds
