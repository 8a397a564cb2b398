#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/base/random.h"
#include "common/scene/world.h"

/// What drawn worlds are made of. Yaw, pitch and roll turn about z, then y, then x; all in radians.
/// Thread-safe: yes (each thread with its own `random`).   Real-time safe: no.
namespace gatefield::training {

Eigen::Isometry3d pose(const Eigen::Vector3d& p, double yaw, double pitch, double roll);

/// A gate of the right size that stands nearly upright; 15 % are tilted by up to 40 deg.
scene::Gate make_gate(const Eigen::Vector3d& p_WG, double yaw, Random* random);

/// A box of any reflectance with its centre at p_W.
scene::Box upright_box(const Eigen::Vector3d& p_W, double yaw, const Eigen::Vector3d& half_m, Random* random);

/// Legs, body and head of somebody who stands at p_W.
std::vector<scene::Box> person_boxes(const Eigen::Vector3d& p_W, double yaw, Random* random);

/// Legs (or one pole) from the frame's lower edge down to the floor, some with feet. Tilted gates stand on upright legs
/// too.
void add_stand(const scene::Gate& gate, double floor_z_m, Random* random, std::vector<scene::Box>* boxes);

/// Distance from a point to a box's surface, 0 inside.
double distance_m(const scene::Box& box, const Eigen::Vector3d& p_W);

/// True when clutter would stand in a gate's opening or within 0.5 m before or behind it (sampled on a 3 x 3 x 3 grid).
bool blocks(const scene::Box& box, const scene::Gate& gate);

}  // namespace gatefield::training
