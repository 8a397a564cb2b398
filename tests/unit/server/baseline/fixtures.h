#pragma once

#include <cmath>

#include "common/base/random.h"
#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"

namespace gatefield::baseline {

/// A gate over a floor and what a camera sees of it.
struct Scene {
  scene::World world;
  CameraModel camera = default_camera();
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  std::vector<float> depth_m;

  Eigen::Isometry3d X_CG() const { return X_WC.inverse() * world.gates[0].X_WG; }
};

/// The camera at the origin, 1.5 m up, looks along x; the gate is turned by yaw from facing it.
inline Scene scene_with(const Eigen::Vector3d& center_W, double yaw_rad, std::uint64_t seed = 0) {
  Scene out;
  scene::Gate gate;
  gate.X_WG.translation() = center_W;
  gate.X_WG.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  out.world.gates.push_back(gate);
  out.X_WC.translation() = Eigen::Vector3d(0, 0, 1.5);
  out.X_WC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  scene::DepthImage image;
  scene::SurfaceImage surface;
  const scene::DepthCamera renderer(out.world);
  renderer.render(out.camera, out.X_WC, &image, &surface);
  if (seed > 0) {
    Random random(seed);
    const scene::DepthImage clean = image;
    scene::apply_noise(scene::SensorNoise{}, out.camera, clean, surface, &random, &image);
  }
  out.depth_m = image.depth_m;
  return out;
}

inline double turn_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return std::acos(std::min(1.0, std::abs(a.linear().col(0).dot(b.linear().col(0)))));
}

}  // namespace gatefield::baseline
