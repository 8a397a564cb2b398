#pragma once

#include <Eigen/Geometry>
#include <span>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/gate.h"

namespace gatefield::training {

/// Hybrid spatial sampling (paper, "Training data"): which part of an image's query points is drawn how. Parts need not
/// sum to 1; they are taken relative to their sum, and rounding goes to `global`.
struct SamplingMix {
  /// Around s = 0: a point of the hourglass's surface with |x| < reach_m, moved by N(0, near_sigma_m).
  double near_surface = 0.35;
  double interior = 0.20;   ///< uniform in (x, then cross-section) inside the hourglass, |x| < reach_m
  double collision = 0.20;  ///< uniform in the physical frame grown by collision_margin_m
  double global = 0.25;     ///< uniform over the image, uniform in depth between the camera's limits
  double reach_m = 2.0;     ///< how far along the gate's axis the first two reach
  double near_sigma_m = 0.10;
  double collision_margin_m = 0.10;
};

/// Says which field is wrong and why: parts >= 0 with a positive sum, lengths > 0.
Status validate(const SamplingMix& mix);

/// Draws query points for one gate and their true field values, sdf_m[i] = guide_sdf(shape, X_CG^-1 points_C[i]).
/// Points come in the order near_surface, interior, collision, global.
/// @param points_C [N][3] interleaved, metres, camera frame (some lie outside of the image or behind the camera, as
/// rollouts do)
/// @param sdf_m    [N]
/// @pre points_C.size() == 3 * sdf_m.size(), validate(mix).ok()
/// Thread-safe: yes (each thread with its own `random`).   Real-time safe: yes.   About 96 points in 3 us.
void sample_points(const SamplingMix& mix, const CameraModel& camera, const GateShape& shape,
                   const Eigen::Isometry3f& X_CG, Random* random, std::span<float> points_C, std::span<float> sdf_m);

/// Uniform points with |x|, |y|, |z| < half_m in the gate's frame: the 'box' that errors are reported in.
void sample_box(double half_m, const GateShape& shape, const Eigen::Isometry3f& X_CG, Random* random,
                std::span<float> points_C, std::span<float> sdf_m);

/// Uniform over the image and in depth between the camera's limits, without a gate. @pre points_C.size() % 3 == 0
void sample_frustum(const CameraModel& camera, Random* random, std::span<float> points_C);

}  // namespace gatefield::training
