#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/packet_check.h"
#include "common/dds/participant_id.h"

namespace gatefield::dds {

/// What comes into a domain that is closed to strangers, before the DDS library reads it. Fast DDS 2.9.1 decrypts what
/// is encrypted, and takes what is not as well: it asks neither whether a submessage had to be encrypted nor whether
/// it proves its origin, and believes every announcement and goodbye of a participant. So only this much passes:
///   - what is encrypted, with a proof for its receiver (of the keys' exchange, that two share: without);
///   - announcements, of each participant always the same one, and never its goodbye (CVE-2023-50257), which may be
///     anybody's: who goes withdraws what he said, encrypted, or is missed after 3 s;
///   - the handshake that makes somebody known. Its fragments are put together here, and it is read before the library
///     gets it as one (CVE-2025-62603);
///   - heartbeats and acknowledgements of the open endpoints of discovery, through which nothing is said then.
/// It needs the governance that gatefield-keys makes, and no discovery server.
///
/// Thread-safe: yes; a mutex is held for a search among those who are there.   Real-time safe: no (allocates for who is
/// new).
class ClosedDomain {
 public:
  struct Verdict {
    PacketFault fault = PacketFault::kNone;
    std::uint8_t submessage = 0;  ///< id of the one at fault
    bool waits = false;           ///< kept here until the rest of it comes
  };
  /// @param datagram  one that check_packet() has passed
  /// @param pass      becomes what the library may read: the datagram, or a handshake that is whole now; as long as
  ///                  `whole` and the datagram live
  /// @param whole     room for it, of the thread
  Verdict check(std::span<const std::uint8_t> datagram, Stamp now, std::span<const std::uint8_t>* pass,
                std::vector<std::uint8_t>* whole);

 private:
  using Bytes = std::span<const std::uint8_t>;
  struct Announced {
    ParticipantId who;
    Stamp heard{};
    std::vector<std::uint8_t> words;
  };
  struct Handshake {
    ParticipantId who;
    std::int64_t sequence = 0;
    Stamp heard{};
    std::vector<std::uint8_t> bytes;
    std::vector<bool> there;  ///< by fragment
  };
  PacketFault announced(const ParticipantId& who, Bytes words, Stamp now);
  PacketFault take_fragments(const ParticipantId& who, Bytes body, std::uint8_t flags, Stamp now,
                             std::vector<std::uint8_t>* whole);

  std::mutex mutex_;
  std::vector<Announced> announced_;
  std::vector<Handshake> handshakes_;
};

}  // namespace gatefield::dds
