#include "client/simulator/depth_sensor.h"

#include <algorithm>
#include <cmath>

namespace gatefield::simulator {

DepthSensor::DepthSensor(const scene::World& world, const config::Scenario& scenario)
    : camera_(scenario.vehicle.camera),
      noise_(scene::one_sensor(scenario.sensor_noise, scenario.seed)),
      random_(scenario.seed, Stream("gatefield.sensor_noise")) {
  if (scenario.stereo) {
    stereo_.emplace(world, *scenario.stereo, scenario.seed);
  } else {
    renderer_.emplace(world);
  }
}

const scene::DepthImage& DepthSensor::capture(const Eigen::Isometry3d& X_WB) {
  if (stereo_) {
    stereo_->render(camera_, X_WB * camera_.X_BC, &random_, &noisy_);
    return noisy_;
  }
  renderer_->render(scene::rendered_camera(noise_, camera_), X_WB * camera_.X_BC, &clean_, &surface_);
  scene::apply_noise(noise_, camera_, clean_, surface_, &random_, &noisy_);
  return noisy_;
}

const std::vector<std::uint16_t>& DepthSensor::counts() {
  counts_.resize(noisy_.depth_m.size());
  const auto counts_per_metre = static_cast<float>(1.0 / camera_.metres_per_count);
  std::transform(noisy_.depth_m.begin(), noisy_.depth_m.end(), counts_.begin(), [counts_per_metre](float depth_m) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(depth_m * counts_per_metre), 0L, 65535L));
  });
  return counts_;
}

}  // namespace gatefield::simulator
