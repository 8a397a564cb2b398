#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "server/gates/gate_records.h"

namespace gatefield::gates {

/// The gates as the control step knows them: from perception's newest snapshot where it has seen them, else from the
/// course. A waypoint that passes a gate of the snapshot knows it, whichever waypoint the gate was seen for.
/// Thread-safe: no (control step).   Real-time safe: yes.
class KnownGates {
 public:
  /// @param passages  of the course; outlives this
  explicit KnownGates(const Passages* passages) noexcept : passages_(passages) {}

  /// @param snapshot  valid until the next one; fields of beliefs point into it
  void take(const Snapshot* snapshot) noexcept { snapshot_ = snapshot; }
  /// The one taken last; null: none was.
  const Snapshot* snapshot() const noexcept { return snapshot_; }

  GateBelief belief(std::uint32_t waypoint) const noexcept;
  /// How old the newest sight of it is, seconds; -1 when it was never seen.
  double age_s(std::uint32_t waypoint, Stamp at) const noexcept;

 private:
  const RememberedGate* seen(std::uint32_t waypoint) const noexcept;

  const Passages* passages_;
  const Snapshot* snapshot_ = nullptr;
};

}  // namespace gatefield::gates
