#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "common/base/clock.h"
#include "common/protocol/server_status.h"

namespace gatefield::service {

/// The other servers of the domain, as they say they are: who has more room than this one answers newcomers before it.
/// What they say is believed to the extent of a short wait, since anybody can say it.
/// Thread-safe: yes; a mutex is held for a look at some entries.
class Neighbours {
 public:
  /// Without a word for so long a server counts as gone: four of its statuses.
  static constexpr std::chrono::nanoseconds kSilence = std::chrono::seconds(1);
  static constexpr std::size_t kMost = 32;
  /// Differences of room below this are none, cores; the name then decides.
  static constexpr double kAlike_cores = 0.05;
  static constexpr std::chrono::nanoseconds kTurn = std::chrono::milliseconds(150);
  /// The longest wait is kMostTurns of kTurn.
  static constexpr int kMostTurns = 4;

  void hear(const protocol::ParticipantBytes& from, const protocol::ServerStatus& status, Stamp now);

  /// How long this server leaves newcomers to the others.
  std::chrono::nanoseconds wait(const protocol::ServerStatus& own, Stamp now) const;

 private:
  struct Neighbour {
    protocol::ServerStatus status;
    Stamp heard{0};
  };
  mutable std::mutex mutex_;
  std::map<protocol::ParticipantBytes, Neighbour> neighbours_;
};

}  // namespace gatefield::service
