#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/course/course.h"
#include "common/scene/world.h"

namespace gatefield::config {

/// A course file in the terms of the code: what the planner is told (`course`), and what only the world knows (the
/// rest).
struct Track {
  std::string title;
  /// Directions are filled in, also where the file leaves them out, the floor's height, and gate ids where waypoints
  /// share a place.
  Course course;
  std::vector<float> gate_reflectance;  ///< by waypoint
  std::vector<double> leg_width_m;      ///< by waypoint; 0: its gate stands on no legs
  Eigen::Vector3d start_p_WB = Eigen::Vector3d::Zero();
  double start_yaw_rad = 0.0;
  Eigen::AlignedBox3d flight_volume;
  std::vector<scene::Box> clutter;  ///< boxes and poles
  bool has_floor = false;
  double floor_z_m = 0.0;
  float floor_reflectance = 0.6f;
};

/// Reads a course file (schema: course.proto) and checks it: 1 to 64 waypoints, gate shapes, waypoints and start inside
/// the flight volume, gates above the floor.
/// Errors: as load_text(); kInvalid with the field ("waypoint[2].position"), and a sentence that names file, field,
/// value and what was expected.
/// Thread-safe: yes.   Real-time safe: no.
Result<Track> load_track(const std::filesystem::path& file);

/// The world as the course file has it: each physical gate once, numbered as gate_index() has it, at its nominal pose
/// as the first waypoint that passes it says; then what else stands there (furnish()).
scene::World nominal_world(const Track& track);

/// The same with the gates alone, for who moves them first.
scene::World bare_world(const Track& track);
/// Adds the clutter, and legs under the gates where those stand now.
void furnish(const Track& track, scene::World* world);

/// What a lap passes, one per waypoint: the gate of nominal_world() or perturbed_world(), and whether along its x axis,
/// which is the direction of the first waypoint that passes it.
std::vector<scene::Passage> passages(const Course& course);

/// The gates as they are passed, one per waypoint: scene::as_passed() of each of passages().
std::vector<scene::Gate> gates_by_waypoint(const scene::World& world, const Course& course);

}  // namespace gatefield::config
