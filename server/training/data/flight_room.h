#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/base/random.h"
#include "common/scene/stereo_camera.h"
#include "common/scene/world.h"
#include "server/training/data/flight_path.h"

/// Rooms with a course in them, and where its gates are put for one flight. Not for use outside of this folder.
/// Thread-safe: yes, each thread with its own `random`.
namespace gatefield::training {

/// Where a gate of the course nominally stands. W: floor at z = 0, the course around the origin.
struct Station {
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  double yaw = 0.0;  ///< of the passing direction
};

struct Room {
  std::vector<Station> course;
  std::vector<scene::Box> walls;
  std::vector<std::vector<scene::Box>> clutter;  ///< things; a thing goes as a whole when it is in the way
  float floor_reflectance = 0.6f;
  scene::StereoOptions sensor;
  std::uint64_t texture_seed = 0;
};

/// Draws room `number` of a set from (seed, number) alone: a course of 3 to 6 gates that can be flown, walls around it,
/// floor, sometimes a ceiling, clutter, light.
Room draw_room(std::uint64_t seed, std::uint64_t number);

/// Gates on the course: displaced, turned and tilted by `amount` times the most.
std::vector<scene::Gate> place_gates(const std::vector<Station>& course, double amount, Random* random);

/// A path through the gates, off their centres by up to `beside_m`, its direction at each between the course's
/// (`obey` 0) and the gate's own axis (1).
Path path_through(const std::vector<scene::Gate>& gates, const std::vector<Station>& course, double beside_m,
                  double obey, Random* random);

}  // namespace gatefield::training
