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
///   - the handshake that makes somebody known, in one piece, so that check_packet() reads it (CVE-2025-62603);
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
  };
  /// @param datagram  one that check_packet() has passed, and no goodbye (says_goodbye())
  Verdict check(std::span<const std::uint8_t> datagram, Stamp now);

 private:
  using Bytes = std::span<const std::uint8_t>;
  struct Announced {
    ParticipantId who;
    Stamp heard{};
    std::vector<std::uint8_t> words;
  };
  PacketFault announced(const ParticipantId& who, Bytes words, Stamp now);

  std::mutex mutex_;
  std::vector<Announced> announced_;
};

}  // namespace gatefield::dds
