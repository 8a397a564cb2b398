#include "common/course/course.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/text.h"

namespace gatefield {
namespace {

constexpr double kMaxPosition_m = 1e5;
constexpr double kUnitTolerance = 1e-3;
constexpr double kSamePlace_m = 0.01;
constexpr double kLeastAxisCosine = 0.866;  // 30 deg
constexpr double kGateAboveFloor_m = 1.5;

bool same_shape(const GateShape& a, const GateShape& b) noexcept {
  return a.opening == b.opening && a.inner_half_m == b.inner_half_m && a.outer_half_m == b.outer_half_m &&
         a.thickness_m == b.thickness_m;
}

/// The waypoint that named this one's gate first; i itself when none did.
std::size_t first_of_gate(const Course& course, std::size_t i) noexcept {
  const std::uint32_t id = course.waypoints[i].gate_id;
  if (id == 0) return i;
  for (std::size_t j = 0; j < i; ++j)
    if (course.waypoints[j].gate_id == id) return j;
  return i;
}

/// @pre there are waypoints
double lowest_waypoint_m(const Course& course) noexcept {
  const auto lower = [](const Waypoint& a, const Waypoint& b) { return a.p_W.z() < b.p_W.z(); };
  return std::min_element(course.waypoints.begin(), course.waypoints.end(), lower)->p_W.z();
}

Status check_waypoint(const Course& course, std::size_t i) {
  const Waypoint& waypoint = course.waypoints[i];
  const std::string path = "course.waypoints[" + std::to_string(i) + "].";
  if (!waypoint.p_W.allFinite() || !(waypoint.p_W.norm() < kMaxPosition_m))
    return Error::invalid(path + "p_W", text(waypoint.p_W) + " m", "finite and less than 1e5 m from the origin");
  if (!waypoint.direction_W.allFinite() ||
      (!waypoint.direction_W.isZero(0.0) && std::abs(waypoint.direction_W.norm() - 1.0) > kUnitTolerance))
    return Error::invalid(path + "direction_W", text(waypoint.direction_W), "a unit vector, or zero when not known");
  if (waypoint.gate.opening != GateShape::Opening::kSquare && waypoint.gate.opening != GateShape::Opening::kRound)
    return Error::invalid(path + "gate.opening", std::to_string(static_cast<int>(waypoint.gate.opening)),
                          "0 (square) or 1 (round)");
  if (auto s = validate(waypoint.gate); !s) return s.failure().within(path, path);
  const std::size_t first = first_of_gate(course, i);
  if (first == i) return {};
  const Waypoint& named = course.waypoints[first];
  const std::string same = " of waypoints[" + std::to_string(first) + "], which names the same gate (" +
                           std::to_string(waypoint.gate_id) + ")";
  if ((waypoint.p_W - named.p_W).norm() > kSamePlace_m)
    return Error::invalid(path + "p_W", text(waypoint.p_W) + " m", "the place" + same + ", " + text(named.p_W) + " m");
  if (!same_shape(waypoint.gate, named.gate))
    return Error::invalid(path + "gate", "of another shape or size", "the shape" + same);
  return {};
}

}  // namespace

Eigen::Vector3d passing_direction(const Course& course, std::size_t i) noexcept {
  const auto& waypoints = course.waypoints;
  if (!waypoints[i].direction_W.isZero()) return waypoints[i].direction_W.normalized();
  const std::size_t count = waypoints.size();
  const std::size_t before = i > 0 ? i - 1 : (course.closed ? count - 1 : 0);
  const std::size_t after = i + 1 < count ? i + 1 : (course.closed ? 0 : i);
  Eigen::Vector3d direction = waypoints[after].p_W - waypoints[before].p_W;
  if (direction.norm() < 1e-6) direction = waypoints[i].p_W - waypoints[before].p_W;
  return direction.norm() < 1e-6 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(direction.normalized());
}

Eigen::Isometry3d gate_pose(const Eigen::Vector3d& p_W, const Eigen::Vector3d& direction_W) noexcept {
  const Eigen::Vector3d x = direction_W.normalized();
  Eigen::Vector3d y = Eigen::Vector3d::UnitZ().cross(x);
  // Straight up or down any level y will do.
  y = y.norm() < 1e-6 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d(y.normalized());
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.linear() << x, y, x.cross(y);
  X_WG.translation() = p_W;
  return X_WG;
}

std::size_t gate_index(const Course& course, std::size_t i) noexcept {
  const std::size_t first = first_of_gate(course, i);
  std::size_t gates_before = 0;
  for (std::size_t j = 0; j < first; ++j) gates_before += first_of_gate(course, j) == j ? 1 : 0;
  return gates_before;
}

std::size_t gate_count(const Course& course) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) count += first_of_gate(course, i) == i ? 1 : 0;
  return count;
}

double height_reference_m(const Course& course) noexcept {
  return course.floor_z_m ? *course.floor_z_m : lowest_waypoint_m(course) - kGateAboveFloor_m;
}

Status validate(const Course& course) {
  const std::size_t count = course.waypoints.size();
  if (count < 1 || count > kMaxWaypoints)
    return Error::invalid("course.waypoints", std::to_string(count) + " long", "1 to " + std::to_string(kMaxWaypoints));
  for (std::size_t i = 0; i < count; ++i)
    if (auto s = check_waypoint(course, i); !s) return s;
  // Directions that follow from neighbours need those to be good places first.
  for (std::size_t i = 0; i < count; ++i) {
    const std::string field = "course.waypoints[" + std::to_string(i) + "].direction_W";
    const Eigen::Vector3d direction = passing_direction(course, i);
    if (direction.isZero())
      return Error::invalid(field, "zero", "a unit vector, since no neighbour tells the passing direction");
    const std::size_t first = first_of_gate(course, i);
    if (std::abs(direction.dot(passing_direction(course, first))) < kLeastAxisCosine)
      return Error::invalid(field, text(direction),
                            "within 30 deg of the axis of waypoints[" + std::to_string(first) +
                                "], which names the same gate (" + std::to_string(course.waypoints[i].gate_id) + ")");
  }
  if (course.laps < 1 || course.laps > kMaxLaps)
    return Error::invalid("course.laps", std::to_string(course.laps), "1 to " + std::to_string(kMaxLaps));
  if (course.floor_z_m) {
    const double lowest_m = lowest_waypoint_m(course);
    if (!(std::abs(*course.floor_z_m) < kMaxPosition_m) || *course.floor_z_m >= lowest_m)
      return Error::invalid("course.floor_z_m", text(*course.floor_z_m),
                            "below the lowest waypoint, " + text(lowest_m) + " m");
  }
  return {};
}

}  // namespace gatefield
