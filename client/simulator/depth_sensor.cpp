#include "client/simulator/depth_sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/simulator/motion_blur.h"

namespace gatefield::simulator {
namespace {

/// A turn by this much about an axis that is uniform over the sphere.
Eigen::AngleAxisd drawn_turn(double angle_rad, std::uint64_t seed) {
  Random random(seed, Stream("gatefield.mounting"));
  const double z = random.uniform(-1.0, 1.0), heading = random.uniform(0.0, 2.0 * std::numbers::pi);
  const double level = std::sqrt(1.0 - z * z);
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(level * std::cos(heading), level * std::sin(heading), z));
}

}  // namespace

DepthSensor::DepthSensor(const scene::World& world, const config::Scenario& scenario)
    : camera_(scenario.vehicle.camera),
      noise_(scene::one_sensor(scenario.sensor_noise, scenario.seed)),
      random_(scenario.seed, Stream("gatefield.sensor_noise")) {
  if (const double off_rad = scenario.hard.camera.mounting_rad; off_rad > 0)
    camera_.X_BC = camera_.X_BC * drawn_turn(off_rad, scenario.seed);
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

const scene::DepthImage& DepthSensor::capture(std::span<const Eigen::Isometry3d> X_WB) {
  if (stereo_ || X_WB.size() == 1) return capture(X_WB[X_WB.size() / 2]);
  moments_.resize(X_WB.size());
  surfaces_.resize(X_WB.size());
  for (std::size_t i = 0; i < X_WB.size(); ++i)
    renderer_->render(scene::rendered_camera(noise_, camera_), X_WB[i] * camera_.X_BC, &moments_[i], &surfaces_[i]);
  merge_exposure(moments_, surfaces_, camera_.fx_px, noise_.baseline_m, &clean_, &surface_);
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
