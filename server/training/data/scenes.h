#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "common/base/random.h"
#include "common/geometry/camera.h"
#include "common/scene/world.h"

namespace gatefield::training {

/// Raise it whenever draw_scenario() or what is rendered from it changes: sets remember it, and are not continued with
/// other scenes than they began with.
inline constexpr int kScenesVersion = 2;

/// A world and where the camera stands in it. W: the target gate's centre is the origin, its axis is +x before its own
/// tilt.
struct Scenario {
  scene::World world;     ///< gates: first those that count (target first), then the ones of the wrong size
  std::size_t gates = 0;  ///< how many count
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
};

struct SceneOptions {
  double round_part = 0.0;  ///< of the gates, those of the wrong size too: 0 (all square) to 1 (all round)
  bool alone = false;       ///< gates and their stands alone, what is around them comes from elsewhere
};

/// Draws gates, stands, rooms, clutter and a camera pose all over the approach volume at racing attitudes; about a
/// fifth of the scenarios is meant to show no gate. Which gates are round is drawn beside the rest: with another
/// round_part it is the same world and about the same view. Thread-safe: yes (each thread with its own `random`).
/// Real-time safe: no.
Scenario draw_scenario(const CameraModel& camera, Random* random, const SceneOptions& options = {});

}  // namespace gatefield::training
