#pragma once

#include <cstdint>
#include <vector>

#include "common/course/course.h"
#include "server/gates/gate_belief.h"

namespace gatefield::gates {

/// Which physical gate each waypoint of a course passes, and which way. A gate's own direction is that of its first
/// passage: what is remembered of a gate is kept in it, and turned into the direction of the waypoint that asks.
/// Thread-safe: yes (const).   Real-time safe: all but the constructor.
class Passages {
 public:
  /// @pre the course is valid
  explicit Passages(const Course& course);

  std::uint32_t waypoints() const noexcept { return static_cast<std::uint32_t>(nominal_.size()); }
  std::uint32_t gates() const noexcept { return gates_; }
  /// Number of the physical gate, from 0.
  std::uint32_t gate(std::uint32_t waypoint) const noexcept { return gate_[waypoint]; }
  /// Belief from the course alone: nominal centre and shape, axis in the passing direction.
  const GateBelief& nominal(std::uint32_t waypoint) const noexcept { return nominal_[waypoint]; }
  /// An axis in the gate's own direction as this waypoint sees it, and the other way round.
  Eigen::Vector3d turned(std::uint32_t waypoint, const Eigen::Vector3d& axis_W) const noexcept {
    return against_[waypoint] ? Eigen::Vector3d(-axis_W) : axis_W;
  }

 private:
  std::uint32_t gates_ = 0;
  std::vector<std::uint32_t> gate_;
  std::vector<bool> against_;  ///< the waypoint passes its gate against the gate's own direction
  std::vector<GateBelief> nominal_;
};

}  // namespace gatefield::gates
