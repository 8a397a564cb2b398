#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/gate.h"

namespace gatefield::baseline {

struct Detection {
  Eigen::Isometry3f X_CG = Eigen::Isometry3f::Identity();  ///< x points away from the camera
  double score = 0.0;  ///< 1: the whole frame lies in the plane, and the whole opening lets the view through
};

/// A gate of known size in a depth image, without learning, as one would build it today:
///   1. points of the image that could be the gate's: near the prior, or in turn everything from the nearest depth on
///   2. their plane (RANSAC, then least squares)
///   3. what the image says of every spot of that plane: there, seen through, or not known
///   4. the frame's shape slid and turned over it (cv::matchTemplate): frame there, opening seen through
/// Thread-safe: no.   Real-time safe: no (OpenCV allocates).
class ClassicalDetector {
 public:
  explicit ClassicalDetector(const GateShape& shape) : shape_(shape) {}

  /// @param depth_m  row-major z-depth of `camera`, 0 = no return
  /// @param prior_C  about where the gate's centre is; empty: the nearest gate in view
  std::optional<Detection> detect(std::span<const float> depth_m, const CameraModel& camera,
                                  const std::optional<Eigen::Vector3d>& prior_C);

 private:
  std::optional<Detection> in_points(std::span<const float> depth_m, const CameraModel& camera,
                                     const std::optional<Eigen::Vector3d>& prior_C);

  GateShape shape_;
  std::vector<Eigen::Vector3d> points_C_;
};

}  // namespace gatefield::baseline
