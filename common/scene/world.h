#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "common/geometry/gate.h"

namespace gatefield::scene {

/// How a surface answers an active infrared camera: 0 (black, swallows the pattern) to 1 (white).
using Reflectance = float;

struct Box {
  Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();  ///< box centre and axes in the world
  Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.5);
  Reflectance reflectance = 0.7f;
};

struct Gate {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  GateShape shape;
  Reflectance reflectance = 0.7f;
};

/// Everything a camera can see and a drone can hit. World frame W is ENU, z up; a floor lies at z = floor_z_m when
/// has_floor.
struct World {
  std::vector<Gate> gates;  ///< each that stands there once, however often it is passed
  std::vector<Box> boxes;   ///< clutter: walls, poles, boxes
  bool has_floor = true;
  double floor_z_m = 0.0;
  Reflectance floor_reflectance = 0.6f;
};

/// One passage of a lap: which gate of the world, and whether along its x axis or against it. A gate that stands once
/// may be passed several times.
struct Passage {
  std::size_t gate = 0;  ///< index into World::gates
  bool along_x = true;
};

/// The gate as that passage flies it: its x axis is the way through. Passed against its own x, the gate's axes are
/// turned half about z; nothing else differs, and the frame's boxes are the same.
/// @pre passage.gate < world.gates.size()
inline Gate as_passed(const World& world, const Passage& passage) {
  Gate gate = world.gates[passage.gate];
  if (!passage.along_x) gate.X_WG.linear().leftCols<2>() *= -1.0;
  return gate;
}

/// The boxes that a gate's frame is made of, in the world: 4 for a square opening, a ring of 16 for a round one.
/// Depth camera and physics use the same ones, so what is seen is what is hit.
std::vector<Box> frame_boxes(const Gate& gate);

/// Two legs under a gate's lower corners (of a round one: at 45 degrees below its middle), upright down to the floor,
/// of this width and as deep as the frame. None where a corner is at the floor already.
std::vector<Box> leg_boxes(const Gate& gate, double width_m, double floor_z_m);

/// Everything solid except the floor: world.boxes, then the frame_boxes() of each gate in turn.
std::vector<Box> solid_boxes(const World& world);

}  // namespace gatefield::scene
