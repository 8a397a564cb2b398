#include "client/simulator/depth_sensor.h"

#include <algorithm>
#include <cmath>

#include "common/config/scenario.h"

namespace gatefield::simulator {

DepthSensor::DepthSensor(const scene::World& world, const CameraModel& camera, const scene::SensorNoise& noise,
                         std::uint64_t seed)
    : renderer_(world),
      camera_(camera),
      noise_(noise),
      random_(seed, static_cast<std::uint64_t>(config::Stream::kSensorNoise)) {}

const scene::DepthImage& DepthSensor::capture(const Eigen::Isometry3d& X_WB) {
  renderer_.render(camera_, X_WB * camera_.X_BC, &clean_, &surface_);
  scene::apply_noise(noise_, camera_, clean_, surface_, &random_, &noisy_);
  return noisy_;
}

const std::vector<std::uint16_t>& DepthSensor::millimetres() {
  depth_mm_.resize(noisy_.depth_m.size());
  std::transform(noisy_.depth_m.begin(), noisy_.depth_m.end(), depth_mm_.begin(), [](float depth_m) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(depth_m * 1000.0f), 0L, 65535L));
  });
  return depth_mm_;
}

}  // namespace gatefield::simulator
