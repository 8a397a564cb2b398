#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::protocol {

inline constexpr std::uint32_t kPilotRecordVersion = 1;
/// A pilot's saved state takes some kilobytes; more than this is none.
inline constexpr std::size_t kMaxPilotBytes = 60'000;
/// Take-overs of one session that are told apart.
inline constexpr std::uint32_t kMaxTakeOvers = 1'000'000;

/// What a server and its stand-by tell each other about a vehicle that one of them flies (idl/servers.idl). The server
/// that flies is the leader, the one that would go on its heir.
struct PilotRecord {
  enum class Kind : std::uint8_t {
    kFollow = 0,    ///< leader to heir, again and again: the pilot as it is now
    kHandOver = 1,  ///< leader to heir: the pilot as it is at last; the heir flies from here on
    kOver = 2,      ///< leader to heir: the session has ended
    kReady = 3,     ///< heir to leader: could fly this session from now on
    kTaken = 4,     ///< to who wrote the session down: it is flown here, after more take-overs than there; he lets go
  };
  std::uint32_t version = kPilotRecordVersion;
  std::string vehicle;        ///< the vehicle's name
  std::uint64_t session = 0;  ///< its session, never 0
  std::uint64_t request = 0;  ///< the request that the session answers, never 0
  Kind kind = Kind::kFollow;
  /// How often the session was taken over, kTaken's own included. Who has more has the session, and his commands
  /// outweigh those of all before him.
  std::uint32_t take_overs = 0;
  Stamp written{0};                 ///< clock of the server that wrote this
  std::vector<std::uint8_t> pilot;  ///< kFollow, kHandOver: Pilot::save(); else empty
};

/// Run on every record that comes; what the pilot's bytes say is Pilot::restore()'s to judge.
/// Thread-safe: yes.
Status validate(const PilotRecord& record);

}  // namespace gatefield::protocol
