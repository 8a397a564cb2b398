#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"

/// What a depth camera does to the truth: measured from a recording, and as parameters of scene::SensorNoise.
namespace gatefield::training {

struct NoiseFitOptions {
  /// All frames show the same scene from the same place: what each pixel shows most of the time is taken for the truth.
  /// Needs no true depth. What is wrong in every frame alike (bias, wrong matches and holes that stay) is not seen.
  bool static_scene = false;
  double baseline_m = 0.05;         ///< the camera's; depth alone does not tell it. D435: 0.05
  std::uint64_t max_frames = 1500;  ///< evenly taken from longer recordings
};

/// One parameter: what was found, or that its default was kept and why.
struct FittedParameter {
  std::string field;  ///< of scene::SensorNoise
  double value = 0.0;
  bool fitted = false;
  std::string says;  ///< from how much, or why not
};

struct NoiseFit {
  scene::SensorNoise noise;
  std::vector<FittedParameter> parameters;  ///< in the order of SensorNoise
  double bias_px = 0.0;  ///< mean error of the disparity, at 160 px image width; the noise model has none
  std::uint64_t frames = 0;
};

/// Fits the noise model to a recording, so that apply_noise() over the true depth is like the measured one.
/// Disparity d = fx baseline / z. Edges are where apply_noise() sees them; 'inside' is 3 px away from any.
///
/// - disparity noise: standard deviation of d_measured - d_true inside, clipped at 3 sigma, less what quantisation and
///   the file's millimetres add. Step: largest s for which exp(2 pi i d_measured / s) adds up; 0 when there is none.
/// - speckle: errors beyond 6 sigma inside, by how much of the depth range counts as such.
/// - incidence: missing pixels inside against (1 - cos)^3, a straight line; normals are those of the true depth.
/// - holes: windows of 3 x 3 to 7 x 7 pixels that are missing altogether, which single losses hardly ever make; how
///   their number falls with the window's size gives the radius. Where surfaces stand steeper than 53 deg they are not
///   counted.
/// - bleed: pixels at edges that moved towards the other side. Shadow: missing ones among those that the second imager
///   can't see.
/// - reflectance is not in a recording: its loss is kept, unless no pixel is missing but by holes and incidence.
///
/// Errors: no measured depth; no true depth and not static; not static although said to be; too few pixels to fit
/// anything. Thread-safe: yes.   Real-time safe: no.
Result<NoiseFit> fit_noise(const Dataset& dataset, const NoiseFitOptions& options,
                           const std::function<bool(double part)>& progress = {});

/// As a table for people.
std::string to_text(const NoiseFit& fit);

}  // namespace gatefield::training
