#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/error_name.h"
#include "common/protocol/messages.h"
#include "server/pilot/step_times.h"

namespace gatefield::service {

/// Counts by kind of failure.
using ByCode = std::array<std::uint64_t, kErrorCodes>;

/// What became of all that the service was sent, and what it flies: for graphs and whoever watches over the server.
struct Figures {
  /// Of vehicles; only ever growing, sessions that ended included.
  struct Totals {
    std::uint64_t states_received = 0, states_rejected = 0;
    std::uint64_t frames_received = 0, frames_rejected = 0, frames_invalid = 0;
    std::uint64_t commands_sent = 0, deadlines_missed = 0, ticks_narrow = 0;
    ByCode samples_refused{};  ///< states and frames, by why
    pilot::StepTimes::Counts steps;

    Totals& operator+=(const Totals& other) noexcept {
      states_received += other.states_received;
      states_rejected += other.states_rejected;
      frames_received += other.frames_received;
      frames_rejected += other.frames_rejected;
      frames_invalid += other.frames_invalid;
      commands_sent += other.commands_sent;
      deadlines_missed += other.deadlines_missed;
      ticks_narrow += other.ticks_narrow;
      for (std::size_t i = 0; i < samples_refused.size(); ++i) samples_refused[i] += other.samples_refused[i];
      steps += other.steps;
      return *this;
    }
  };
  /// Processor time, cores.
  struct Room {
    double capacity = 0.0;  ///< that vehicles may take now
    double taken = 0.0;
    double free = 0.0;                         ///< for newcomers; 0 also while ticks are late, or nearly
    std::map<std::string, double> cost_cores;  ///< of a vehicle with the usual camera, by profile
  };
  struct Vehicle {
    protocol::Telemetry telemetry;
    double silent_s = 0.0;      ///< since its newest good state came
    double round_trip_s = 0.0;  ///< newest from state to command that the client measured; 0: none yet
    bool lockstep = false;
  };

  Stamp made{0};        ///< service's clock
  Stamp step_since{0};  ///< since when the longest step in progress runs; `made` when none does
  Totals totals;
  std::uint64_t sessions_begun = 0;
  std::uint64_t strays = 0;  ///< samples for vehicles that have no session here
  ByCode requests_refused{};
  Room room;
  std::uint64_t sessions_shed = 0;       ///< ended because ticks were late
  std::uint64_t sessions_displaced = 0;  ///< ended for a vehicle of higher priority
  std::uint64_t taken_over = 0;          ///< sessions that this server took over
  std::uint64_t handed_over = 0;         ///< sessions that it handed over
  bool heir_there = false;               ///< its stand-by is there
  std::size_t stands_by_for = 0;         ///< vehicles that it could take over now
  std::vector<Vehicle> vehicles;         ///< that have a session
};

}  // namespace gatefield::service
