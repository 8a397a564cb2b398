#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/base/random.h"
#include "common/scene/world.h"

namespace gatefield::scene {

struct Hall {
  Eigen::AlignedBox3d room;            ///< between floor, walls and ceiling
  std::vector<Eigen::Vector3d> way_W;  ///< where vehicles fly, points close to each other
  double clear_m = 2.0;                ///< nothing but the walls comes nearer to it, seen from above
};

/// What stands in a furnished hall: four walls around the room, and one try for every 6 m^2 of floor at a pillar (up to
/// the ceiling), a table, a box, a partition wall or a person (legs, trunk, head) in a random place and heading. A try
/// that comes too near to the way of flight or to what stands there already is given up.
/// Same room, way and random stream, same furniture.   Thread-safe: yes.   Real-time safe: no.
std::vector<Box> furnish(const Hall& hall, Random* random);

}  // namespace gatefield::scene
