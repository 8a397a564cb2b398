#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/protocol/messages.h"
#include "common/scene/world.h"

namespace gatefield::config {

/// A course file in the terms of the code: what the planner is told (`course`), and what only the world knows (the
/// rest).
struct Track {
  std::string title;
  protocol::Course course;  ///< directions are filled in, also where the file leaves them out
  float gate_reflectance = 0.7f;
  Eigen::Vector3d start_p_WB = Eigen::Vector3d::Zero();
  double start_yaw_rad = 0.0;
  Eigen::AlignedBox3d flight_volume;
  std::vector<scene::Box> clutter;  ///< boxes and poles
  bool has_floor = false;
  double floor_z_m = 0.0;
  float floor_reflectance = 0.6f;
};

/// Reads a course file (schema: course.proto) and checks it: 1 to 64 waypoints, gate shape, waypoints and start inside
/// the flight volume, gates above the floor. The sentence names file, field, value and what was expected. Thread-safe:
/// yes.   Real-time safe: no.
Result<Track> load_track(const std::filesystem::path& file);

/// Passing direction at waypoint i, unit: the waypoint's own, or where it has none, from the waypoint before to the one
/// after (at the ends of an open course: from or to the end itself).
/// @pre 0 <= i < waypoints.size()
Eigen::Vector3d passing_direction(const protocol::Course& course, std::size_t i);

/// Pose of a gate at p_W whose x axis is `direction_W` (unit); y is level, z as far up as that allows.
Eigen::Isometry3d gate_pose(const Eigen::Vector3d& p_W, const Eigen::Vector3d& direction_W);

/// The world as the course file has it: gates at their nominal poses.
scene::World nominal_world(const Track& track);

}  // namespace gatefield::config
