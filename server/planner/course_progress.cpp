#include "server/planner/course_progress.h"

#include <algorithm>
#include <cmath>

namespace gatefield::planner {
namespace {

/// How far from the believed centre a crossing may be and still count, beyond the opening's half-width.
constexpr double kSeenTolerance_m = 0.25;
/// Without sight of the gate the nominal plane is all there is; the gate may be far from it.
constexpr double kUnseenTolerance_m = 1.5;
/// After a resumption: a vehicle this near to the way out of the gate has passed it while nobody planned.
constexpr double kOnTheWayOut_m = 3.0;

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  const double part = way.squaredNorm() > 1e-12 ? std::clamp((p - from).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0.0;
  return (p - from - part * way).norm();
}

}  // namespace

CourseProgress::CourseProgress(const Course& course) : course_(course) {}

void CourseProgress::resume(std::uint32_t waypoint, std::uint32_t lap) noexcept {
  if (waypoint >= course_.waypoints.size() || lap >= static_cast<std::uint32_t>(course_.laps)) return;
  target_ = waypoint;
  lap_ = lap;
  done_ = false;
  has_previous_ = false;
  resumed_ = waypoint != 0 || lap != 0;  // at its very beginning, nothing was passed before
}

void CourseProgress::advance() noexcept {
  if (target_ + 1 < course_.waypoints.size()) {
    ++target_;
  } else if (lap_ + 1 < static_cast<std::uint32_t>(course_.laps)) {
    target_ = 0;
    ++lap_;
  } else {
    done_ = true;
  }
}

bool CourseProgress::passed_while_away(const Eigen::Vector3d& p_WB) const noexcept {
  const GateBelief gate = nominal(target_);
  if ((p_WB - gate.center_W).dot(gate.axis_W) < 0.0) return false;
  // Ways in and out are the legs between nominal waypoints; at the ends of an open course they go on along the axis.
  constexpr double kEnd_m = 5.0;
  const Eigen::Vector3d before =
      has_neighbour(-1) ? neighbour(-1) : Eigen::Vector3d(gate.center_W - kEnd_m * gate.axis_W);
  const Eigen::Vector3d after = has_neighbour(1) ? neighbour(1) : Eigen::Vector3d(gate.center_W + kEnd_m * gate.axis_W);
  const double way_out_m = distance_to_segment(p_WB, gate.center_W, after);
  return way_out_m < kOnTheWayOut_m && way_out_m <= distance_to_segment(p_WB, before, gate.center_W);
}

bool CourseProgress::has_neighbour(int offset) const noexcept {
  const int index = static_cast<int>(target_) + offset;
  return course_.closed || (index >= 0 && index < static_cast<int>(course_.waypoints.size()));
}

Eigen::Vector3d CourseProgress::neighbour(int offset) const noexcept {
  const int count = static_cast<int>(course_.waypoints.size());
  return course_.waypoints[static_cast<std::size_t>((static_cast<int>(target_) + offset + count) % count)].p_W;
}

bool CourseProgress::update(const Eigen::Vector3d& p_WB, const GateBelief& target) noexcept {
  const bool had_previous = has_previous_;
  const Eigen::Vector3d from = previous_p_WB_;
  previous_p_WB_ = p_WB;
  has_previous_ = true;
  if (done_) return false;
  if (resumed_) {
    resumed_ = false;
    if (passed_while_away(p_WB)) {
      advance();
      return true;
    }
  }
  if (!had_previous) return false;

  const double before_m = (from - target.center_W).dot(target.axis_W);
  const double after_m = (p_WB - target.center_W).dot(target.axis_W);
  if (!(before_m < 0.0 && after_m >= 0.0)) return false;
  const Eigen::Vector3d crossing = from + (p_WB - from) * (before_m / (before_m - after_m));
  const Eigen::Vector3d off = crossing - target.center_W;
  const double lateral_m = (off - off.dot(target.axis_W) * target.axis_W).norm();
  const double tolerance_m = target.seen ? kSeenTolerance_m : kUnseenTolerance_m;
  if (lateral_m > course_.waypoints[target_].gate.inner_half_m + tolerance_m) return false;

  advance();
  return true;
}

bool CourseProgress::has_next() const noexcept {
  if (done_) return false;
  return target_ + 1 < course_.waypoints.size() || lap_ + 1 < static_cast<std::uint32_t>(course_.laps);
}

std::uint32_t CourseProgress::next() const noexcept {
  if (!has_next()) return target_;
  return (target_ + 1) % static_cast<std::uint32_t>(course_.waypoints.size());
}

GateBelief CourseProgress::nominal(std::uint32_t waypoint) const noexcept {
  GateBelief belief;
  belief.center_W = course_.waypoints[waypoint].p_W;
  belief.axis_W = passing_direction(course_, waypoint);
  belief.seen = false;
  return belief;
}

}  // namespace gatefield::planner
