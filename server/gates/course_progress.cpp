#include "server/gates/course_progress.h"

#include <algorithm>
#include <cmath>

#include "server/gates/gate_size.h"

namespace gatefield::gates {
namespace {

// Of the usual gate (gate_size()):
/// How far from the believed centre a crossing may be and still count, beyond the opening's half-width.
constexpr double kSeenTolerance_m = 0.25;
/// Without sight of the gate the nominal plane is all there is; the gate may be far from it.
constexpr double kUnseenTolerance_m = 1.5;
/// After a resumption: a vehicle this near to the way out of the gate has passed it while nobody planned.
constexpr double kOnTheWayOut_m = 3.0;
/// So far in front of a gate that it has just come through, a vehicle may pass it again.
constexpr double kInFront_m = 0.2;

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  const double part = way.squaredNorm() > 1e-12 ? std::clamp((p - from).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - from - part * way).norm();
}

}  // namespace

CourseProgress::CourseProgress(const Course& course)
    : route_(std::make_shared<const Route>(Route{course, Passages(course)})) {}

bool CourseProgress::has(std::uint32_t waypoint, std::uint32_t lap) const noexcept {
  return waypoint < route_->course.waypoints.size() && lap < static_cast<std::uint32_t>(route_->course.laps);
}

void CourseProgress::resume(std::uint32_t waypoint, std::uint32_t lap) noexcept {
  if (!has(waypoint, lap)) return;
  at_.target = waypoint;
  at_.lap = lap;
  at_.done = false;
  at_.has_previous = false;
  at_.has_before = false;
  at_.resumed = waypoint != 0 || lap != 0;  // at its very beginning, nothing was passed before
}

void CourseProgress::away() noexcept {
  at_.has_previous = false;
  at_.has_before = false;
  at_.resumed = true;
}

bool CourseProgress::restore(const State& state) noexcept {
  if (!has(state.target, state.lap)) return false;
  at_ = state;
  return true;
}

void CourseProgress::advance() noexcept {
  if (at_.target + 1 < route_->course.waypoints.size()) {
    ++at_.target;
  } else if (at_.lap + 1 < static_cast<std::uint32_t>(route_->course.laps)) {
    at_.target = 0;
    ++at_.lap;
  } else {
    at_.done = true;
  }
  if (again()) at_.has_previous = false;
  at_.has_before = false;
}

bool CourseProgress::again() const noexcept {
  if (at_.target == 0 && at_.lap == 0) return false;
  const Passages& passages = route_->passages;
  const std::uint32_t before = at_.target > 0 ? at_.target - 1 : passages.waypoints() - 1;
  return passages.gate(before) == passages.gate(at_.target);
}

bool CourseProgress::passed_while_away(const Eigen::Vector3d& p_WB) const noexcept {
  const GateBelief& gate = nominal(at_.target);
  if (again() || (p_WB - gate.center_W).dot(gate.axis_W) < 0.0) return false;
  // Ways in and out are the legs between nominal waypoints; at the ends of an open course they go on along the axis.
  constexpr double kEnd_m = 5.0;
  const Eigen::Vector3d before =
      has_neighbour(-1) ? neighbour(-1) : Eigen::Vector3d(gate.center_W - kEnd_m * gate.axis_W);
  const Eigen::Vector3d after = has_neighbour(1) ? neighbour(1) : Eigen::Vector3d(gate.center_W + kEnd_m * gate.axis_W);
  const double way_out_m = distance_to_segment(p_WB, gate.center_W, after);
  return way_out_m < kOnTheWayOut_m && way_out_m <= distance_to_segment(p_WB, before, gate.center_W);
}

bool CourseProgress::has_neighbour(int offset) const noexcept {
  const int index = static_cast<int>(at_.target) + offset;
  return route_->course.closed || (index >= 0 && index < static_cast<int>(route_->course.waypoints.size()));
}

Eigen::Vector3d CourseProgress::neighbour(int offset) const noexcept {
  const int count = static_cast<int>(route_->course.waypoints.size());
  return route_->course.waypoints[static_cast<std::size_t>((static_cast<int>(at_.target) + offset + count) % count)]
      .p_W;
}

bool CourseProgress::update(const Eigen::Vector3d& p_WB, const GateBelief& target) noexcept {
  const bool had_previous = at_.has_previous;
  const Eigen::Vector3d from = at_.previous_p_WB;
  at_.previous_p_WB = p_WB;
  at_.has_previous = true;
  if (at_.done) return false;
  if (at_.resumed && had_previous) {
    at_.resumed = false;
    if (passed_while_away(from) && passed_while_away(p_WB)) {
      advance();
      return true;
    }
  }
  const double after_m = (p_WB - target.center_W).dot(target.axis_W);
  const double size = gate_size(target.shape);
  if (!had_previous) {
    at_.has_previous = !again() || after_m <= -kInFront_m;
    return false;
  }
  const double tolerance_m = size * (target.seen ? kSeenTolerance_m : kUnseenTolerance_m);
  if (!crosses(from, p_WB, target.center_W, target.axis_W, tolerance_m) &&
      !(moved(target, size) && crosses(from, p_WB, at_.before_center_W, at_.before_axis_W, tolerance_m))) {
    if (target.seen && after_m <= -size * kBefore_m) {
      at_.has_before = true;
      at_.before_center_W = target.center_W;
      at_.before_axis_W = target.axis_W;
    }
    return false;
  }

  advance();
  return true;
}

bool CourseProgress::crosses(const Eigen::Vector3d& from, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& center_W,
                             const Eigen::Vector3d& axis_W, double tolerance_m) const noexcept {
  const double before_m = (from - center_W).dot(axis_W), after_m = (p_WB - center_W).dot(axis_W);
  if (!(before_m < 0.0 && after_m >= 0.0)) return false;
  const Eigen::Vector3d crossing = from + (p_WB - from) * (before_m / (before_m - after_m));
  const Eigen::Vector3d off = crossing - center_W;
  const double lateral_m = (off - off.dot(axis_W) * axis_W).norm();
  return lateral_m <= route_->course.waypoints[at_.target].gate.inner_half_m + tolerance_m;
}

bool CourseProgress::moved(const GateBelief& target, double size) const noexcept {
  return at_.has_before && ((target.center_W - at_.before_center_W).norm() > size * kMoved_m ||
                            target.axis_W.dot(at_.before_axis_W) < std::cos(kTurned_rad));
}

bool CourseProgress::has_next() const noexcept {
  if (at_.done) return false;
  return at_.target + 1 < route_->course.waypoints.size() ||
         at_.lap + 1 < static_cast<std::uint32_t>(route_->course.laps);
}

std::uint32_t CourseProgress::next() const noexcept {
  if (!has_next()) return at_.target;
  return (at_.target + 1) % static_cast<std::uint32_t>(route_->course.waypoints.size());
}

}  // namespace gatefield::gates
