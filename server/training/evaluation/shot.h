#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"

namespace gatefield::training {

/// One rendered image of a world, with the gates that count as labels (in the world's order).
struct Shot {
  std::vector<float> clean_m, noisy_m;  ///< kImageSize_px, 0 = no return
  std::vector<GateLabel> gates;
};

/// @param gates   how many of the world's gates count
/// Thread-safe: yes (each thread with its own `random`).
Shot take_shot(const scene::DepthCamera& camera, const scene::World& world, std::size_t gates,
               const Eigen::Isometry3d& X_WC, const scene::SensorNoise& noise, Random* random);

}  // namespace gatefield::training
