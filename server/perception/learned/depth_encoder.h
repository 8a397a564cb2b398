#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/model/bundle.h"

namespace gatefield::perception {

/// What one depth frame says about one gate.
struct Encoding {
  std::vector<float> latent;  ///< the decoder's whole condition, bundle.manifest().latent_size() numbers
  /// The centre that is part of the latent (two-look bundles; zero for others), m, camera frame.
  Eigen::Vector3f center_C = Eigen::Vector3f::Zero();
  float validity = 0.0f;           ///< probability that a gate is there
  float predicted_error_m = 0.0f;  ///< the network's own guess of its mean field error around the gate
};

/// Depth image to latent (paper, E_theta), through oneDNN where it has the network's operators (the shipped models')
/// and else through OpenCV dnn, which the log says. Two-look networks (docs/training.md) look at the whole image for a
/// coarse centre, then at a crop around it; a prior from the gate memory or the course replaces the first look.
/// Thread-safe: no, one instance per worker.   Real-time safe: bounded, but allocates: runs on the perception thread.
class DepthEncoder {
 public:
  /// Errors: OpenCV can't load or run a network of the bundle, or gives something else than the bundle's test case.
  static Result<std::unique_ptr<DepthEncoder>> create(const model::Bundle& bundle);
  virtual ~DepthEncoder() = default;

  /// @param depth_m     row-major z-depth, width * height of `camera`, 0 = no return. Any camera the session brought:
  ///                    resampled to the network's input if its intrinsics differ.
  /// @param prior_C     where the wanted gate should be (camera frame); empty = the nearest gate in view.
  /// @return empty when nothing can be encoded (no returns at all, or nothing near the prior).
  /// Throws std::runtime_error, in words of ours, when a network can't be run: that says nothing of the frame.
  virtual std::optional<Encoding> encode(std::span<const float> depth_m, const CameraModel& camera,
                                         const std::optional<Eigen::Vector3d>& prior_C) = 0;
};

}  // namespace gatefield::perception
