#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/random.h"
#include "common/config/scenario.h"
#include "common/geometry/camera.h"
#include "common/scene/depth_camera.h"
#include "common/scene/sensor_noise.h"
#include "common/scene/stereo_camera.h"

namespace gatefield::simulator {

/// The vehicle's depth camera: what it would see of the true world, with the sensor's noise; or a pair of cameras whose
/// pictures are matched, when the scenario has one. It hangs where it truly does, not where it is told to
/// (config::CameraErrors::mounting_rad).
/// Thread-safe: no (one thread at a time).   Real-time safe: no.
class DepthSensor {
 public:
  DepthSensor(const scene::World& world, const config::Scenario& scenario);

  /// Takes a frame from the given pose of the body; valid until the next call. Same sequence of calls, same images.
  const scene::DepthImage& capture(const Eigen::Isometry3d& X_WB);
  /// The same over an exposure, from poses of the body spread over it evenly; one is an instant. The pair of cameras
  /// takes the middle one alone: its pictures are not blurred.
  const scene::DepthImage& capture(std::span<const Eigen::Isometry3d> X_WB);
  /// The last frame in counts of the camera's metres_per_count, 0 = no return, as an active stereo camera delivers it.
  /// What is farther than 65535 counts becomes 65535.
  const std::vector<std::uint16_t>& counts();
  /// As it truly is.
  const CameraModel& camera() const noexcept { return camera_; }

 private:
  std::optional<scene::DepthCamera> renderer_;  // one of the two
  std::optional<scene::StereoCamera> stereo_;
  CameraModel camera_;
  scene::SensorNoise noise_;
  Random random_;
  std::vector<scene::DepthImage> moments_;
  std::vector<scene::SurfaceImage> surfaces_;
  scene::DepthImage clean_;
  scene::SurfaceImage surface_;
  scene::DepthImage noisy_;
  std::vector<std::uint16_t> counts_;
};

}  // namespace gatefield::simulator
