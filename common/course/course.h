#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/gate.h"

namespace gatefield {

inline constexpr int kMaxWaypoints = 64;
inline constexpr int kMaxLaps = 1000;

/// One passage of the course: about where a gate is, and which way it is flown through.
struct Waypoint {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< nominal centre of the opening, world frame (ENU), m
  /// Rough passing direction, unit; zero: follows from the neighbours (passing_direction()).
  Eigen::Vector3d direction_W = Eigen::Vector3d::Zero();
  GateShape gate;  ///< nominal shape of the gate
  /// Names the physical gate: waypoints with the same number other than 0 are passages of one gate, in the same or the
  /// opposite direction. 0: a gate that no other waypoint passes.
  std::uint32_t gate_id = 0;

  Waypoint() = default;
  Waypoint(const Eigen::Vector3d& center_W, const Eigen::Vector3d& passing_W = Eigen::Vector3d::Zero(),
           const GateShape& shape = {}, std::uint32_t id = 0)  // NOLINT(google-explicit-constructor): {{x, y, z}}
      : p_W(center_W), direction_W(passing_W), gate(shape), gate_id(id) {}
};

/// What is flown, as anybody may know it: nominal gates in their order. True poses are nowhere in here.
struct Course {
  std::vector<Waypoint> waypoints;  ///< 1 to kMaxWaypoints, in the order of flight
  int laps = 1;                     ///< 1 to kMaxLaps
  bool closed = true;               ///< after the last waypoint of a lap comes the first one
  std::optional<double> floor_z_m;  ///< height of the floor in the world frame, when it is known
};

/// Passing direction at waypoint i, unit: the waypoint's own; where it has none, along the chord from the waypoint
/// before to the one after, in 3-D (at the ends of an open course: from or to the end itself; where both neighbours are
/// the same point: the way in). Zero when there is nothing to tell it from. The one formula for files, clients and
/// server. @pre i < waypoints.size()   Thread-safe: yes.   Real-time safe: yes.
Eigen::Vector3d passing_direction(const Course& course, std::size_t i) noexcept;

/// Pose of a gate at p_W whose x axis is `direction_W` (unit); y is level, z as far up as that allows.
Eigen::Isometry3d gate_pose(const Eigen::Vector3d& p_W, const Eigen::Vector3d& direction_W) noexcept;

/// Number of the physical gate that waypoint i passes, from 0 in the order of first passage; waypoints that name one
/// gate have the same. @pre i < waypoints.size()   Real-time safe: yes (looks through the waypoints before i).
std::size_t gate_index(const Course& course, std::size_t i) noexcept;
/// How many physical gates there are.
std::size_t gate_count(const Course& course) noexcept;

/// The floor, where it is known; else 1.5 m below the lowest waypoint, where it would be under a gate on a stand.
/// Heights in planner profiles count from here. @pre there are waypoints
double height_reference_m(const Course& course) noexcept;

/// Says which field is wrong and why: 1 to 64 waypoints at finite places less than 1e5 m away, directions of unit
/// length or zero, and not zero where nothing gives one; gate shapes as gatefield::validate(GateShape) has them;
/// waypoints that name one gate agree on its place (1 cm), shape and axis (30 deg, either way); 1 to 1000 laps; the
/// floor below the gates' centres. Fields are named as "course.waypoints[2].p_W".
Status validate(const Course& course);

}  // namespace gatefield
