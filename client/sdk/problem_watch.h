#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "gatefield/sdk/client.h"

namespace gatefield::sdk {

/// What the server says is wrong: together what the newest command and the newest telemetry say, and what of it has
/// changed since somebody asked. Commands alone would not do: a server that withholds its plans says so by telemetry.
/// Thread-safe: no (the client's lock).   Real-time safe: yes (fixed memory).
class ProblemWatch {
 public:
  /// Changes that may wait to be asked for; of more, the oldest are lost.
  static constexpr std::size_t kWaiting = 64;

  void on_command(protocol::Problems problems) noexcept { update(&of_command_, problems); }
  void on_telemetry(protocol::Problems problems) noexcept { update(&of_telemetry_, problems); }
  /// A new session: nothing is known to be wrong.
  void reset() noexcept;

  protocol::Problems now() const noexcept { return of_command_ | of_telemetry_; }
  /// The oldest change that was not asked for before.
  std::optional<ProblemChange> next() noexcept;

 private:
  void update(protocol::Problems* of_source, protocol::Problems problems) noexcept;
  void add(const ProblemChange& change) noexcept;

  protocol::Problems of_command_ = 0;
  protocol::Problems of_telemetry_ = 0;
  std::array<ProblemChange, kWaiting> changes_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

}  // namespace gatefield::sdk
