#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>

#include "common/course/course.h"
#include "server/gates/passages.h"

namespace gatefield::gates {

/// Where in the course a vehicle is, as far as the planner can know: it counts a gate as passed when the vehicle
/// crosses the believed plane inside the believed opening in the passing direction. The referee's word is another
/// matter. What was believed when the vehicle was last kBefore_m before the gate counts, too, if the belief has since
/// moved by more than kMoved_m or turned by more than kTurned_rad: a vehicle flies through what it saw. Where the same
/// gate comes twice in a row, the second passage counts only once the vehicle was 0.2 m in front of it again: it may
/// have come to hardly beyond the plane, and the belief of where that is moves.
/// Thread-safe: no.   Real-time safe: all but the constructor; a copy shares the course.
class CourseProgress {
 public:
  // Lengths are those of the usual gate (gate_size()).
  static constexpr double kBefore_m = 1.0;
  static constexpr double kMoved_m = 0.35;
  static constexpr double kTurned_rad = 0.6;

  /// @pre the course is valid
  explicit CourseProgress(const Course& course);

  const Passages& passages() const noexcept { return route_->passages; }

  /// Goes on from a gate and lap that an earlier server had reached. A vehicle that the next two update() find beyond
  /// the nominal plane and nearer to the way out than to the way in has coasted through the gate in between, and that
  /// gate counts as passed (but for a gate that was also the one before: it is then behind the vehicle anyhow). Two,
  /// since the first state of all has no other that it could be held against: a false one is followed by
  /// begin_elsewhere().
  void resume(std::uint32_t waypoint, std::uint32_t lap) noexcept;

  /// The vehicle was not heard of for a while, and may have passed the target meanwhile: found out as after resume().
  void away() noexcept;

  /// The next position has nothing to do with those before it: nothing is crossed on the way there.
  void begin_elsewhere() noexcept { at_.has_previous = false; }

  /// Advances with the vehicle's new position. @return true when the target changed.
  bool update(const Eigen::Vector3d& p_WB, const GateBelief& target) noexcept;

  std::uint32_t target() const noexcept { return at_.target; }
  std::uint32_t lap() const noexcept { return at_.lap; }
  bool done() const noexcept { return at_.done; }

  bool has_next() const noexcept;
  std::uint32_t next() const noexcept;  ///< waypoint after the target; the target itself when there is none

  /// Belief from the course alone: Passages::nominal().
  const GateBelief& nominal(std::uint32_t waypoint) const noexcept { return route_->passages.nominal(waypoint); }

  /// All that update() and resume() change: to be written down, and set to what was.
  struct State {
    std::uint32_t target = 0;
    std::uint32_t lap = 0;
    bool done = false;
    bool has_previous = false;  ///< no crossing counts without
    bool resumed = false;       ///< by resume(), and not found twice since
    Eigen::Vector3d previous_p_WB = Eigen::Vector3d::Zero();
    bool has_before = false;  ///< of this target
    Eigen::Vector3d before_center_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d before_axis_W = Eigen::Vector3d::UnitX();
  };
  const State& state() const noexcept { return at_; }
  /// @return false, and nothing changes, when the course has no such waypoint or lap
  bool restore(const State& state) noexcept;

 private:
  struct Route {
    Course course;
    Passages passages;
  };
  bool has(std::uint32_t waypoint, std::uint32_t lap) const noexcept;
  void advance() noexcept;
  /// Whether the way from the previous position to p_WB leads through the opening at this centre and axis.
  bool crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& center_W,
               const Eigen::Vector3d& axis_W, double tolerance_m) const noexcept;
  /// Whether the belief is another one than it was before the vehicle came near.
  bool moved(const GateBelief& target, double size) const noexcept;
  bool passed_while_away(const Eigen::Vector3d& p_WB) const noexcept;
  /// Whether the target is the gate that was passed last.
  bool again() const noexcept;
  bool has_neighbour(int offset) const noexcept;         ///< of the target along a lap, offset +-1
  Eigen::Vector3d neighbour(int offset) const noexcept;  ///< its nominal centre. @pre has_neighbour(offset)

  std::shared_ptr<const Route> route_;
  State at_;
};

}  // namespace gatefield::gates
