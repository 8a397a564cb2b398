#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "server/perception/gate_memory.h"
#include "server/planner/course_progress.h"
#include "server/planner/planner.h"

namespace gatefield::service {

/// The gates as the control step knows them: from perception's newest snapshot where it has seen them, else from the
/// course. Thread-safe: no (control step).   Real-time safe: yes.
class KnownGates {
 public:
  /// @param course     of `waypoints` waypoints, for what was not seen; outlives this
  KnownGates(const planner::CourseProgress* course, std::size_t waypoints) noexcept
      : course_(course), waypoints_(waypoints) {}

  /// @param memory  valid until the next one; fields of beliefs point into it
  void take(const perception::MemorySnapshot* memory) noexcept { memory_ = memory; }

  planner::GateBelief belief(std::uint32_t waypoint) const noexcept;
  /// What is known, but the centre where the course has it.
  planner::GateBelief belief_at_nominal_center(std::uint32_t waypoint) const noexcept;
  /// How old the newest sight of it is, seconds; -1 when it was never seen.
  double age_s(std::uint32_t waypoint, Stamp at) const noexcept;

 private:
  const perception::RememberedGate* seen(std::uint32_t waypoint) const noexcept;

  const planner::CourseProgress* course_;
  std::size_t waypoints_;
  const perception::MemorySnapshot* memory_ = nullptr;
};

}  // namespace gatefield::service
