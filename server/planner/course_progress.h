#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/protocol/messages.h"
#include "server/planner/field.h"

namespace gatefield::planner {

/// Where in the course a vehicle is, as far as the planner can know: it counts a gate as passed when the vehicle
/// crosses the believed plane inside the believed opening in the passing direction. The referee's word is another
/// matter. Thread-safe: no.   Real-time safe: yes.
class CourseProgress {
 public:
  explicit CourseProgress(const Course& course);

  /// Goes on from a gate and lap that an earlier server had reached. A vehicle that the next update() finds beyond the
  /// nominal plane and nearer to the way out than to the way in has coasted through the gate in between, and that gate
  /// counts as passed.
  void resume(std::uint32_t waypoint, std::uint32_t lap) noexcept;

  /// Advances with the vehicle's new position. @return true when the target changed.
  bool update(const Eigen::Vector3d& p_WB, const GateBelief& target) noexcept;

  std::uint32_t target() const noexcept { return target_; }
  std::uint32_t lap() const noexcept { return lap_; }
  bool done() const noexcept { return done_; }

  bool has_next() const noexcept;
  std::uint32_t next() const noexcept;  ///< waypoint after the target; the target itself when there is none

  /// Belief from the course alone: nominal centre, axis from the waypoint's direction or its neighbours.
  GateBelief nominal(std::uint32_t waypoint) const noexcept;

 private:
  void advance() noexcept;
  bool passed_while_away(const Eigen::Vector3d& p_WB) const noexcept;
  bool has_neighbour(int offset) const noexcept;         ///< of the target along a lap, offset +-1
  Eigen::Vector3d neighbour(int offset) const noexcept;  ///< its nominal centre. @pre has_neighbour(offset)

  Course course_;
  std::uint32_t target_ = 0;
  std::uint32_t lap_ = 0;
  bool done_ = false;
  bool has_previous_ = false;
  bool resumed_ = false;
  Eigen::Vector3d previous_p_WB_ = Eigen::Vector3d::Zero();
};

}  // namespace gatefield::planner
