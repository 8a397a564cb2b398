#pragma once

#include <cstdint>
#include <optional>

#include "common/base/random.h"
#include "common/base/result.h"
#include "common/scene/active_stereo_noise.h"
#include "common/scene/depth_camera.h"

namespace gatefield::scene {

/// Noise of an active stereo depth camera (D435-like), in the order in which it is applied. It is the first model,
/// guessed from data sheets; what shipped models were trained with and published flights flown with.
struct SensorNoise {
  double baseline_m = 0.05;            ///< stereo baseline: sets shadows and the disparity scale
  double disparity_noise_px = 0.03;    ///< sigma of the disparity per pixel, at 160 px image width (0.16 px at 848)
  double disparity_step_px = 0.00625;  ///< quantisation of the disparity, at 160 px image width (1/30 px at 848)
  double bleed_probability = 0.35;     ///< at a depth edge, the pixel takes a neighbour's depth or a mixture
  double shadow_probability = 0.8;     ///< pixel occluded for the second imager becomes invalid
  double hole_rate_per_image = 3.0;    ///< mean number of elliptic holes
  double hole_radius_px = 4.0;         ///< mean radius
  double speckle_probability = 0.003;  ///< wrong match: a random depth
  double incidence_loss = 0.6;         ///< probability of loss at grazing incidence, times (1 - cos)^3
  double reflectance_loss = 0.5;       ///< probability of loss on black surfaces, times (1 - reflectance)^3
  double scale = 1.0;                  ///< 0 = ideal camera, 1 = as above, 2 = twice the noise and loss
  /// The model that was measured, in place of all above but `scale`.
  std::optional<ActiveStereoNoise> active_stereo = std::nullopt;
};

/// Says which field is wrong and why. Errors: kInvalid with the field ("noise.scale").
Status validate(const SensorNoise& noise);

/// The camera that the clean image is to be rendered with: the same, but it sees beyond its range where the noise can
/// bring surfaces from there into it.
CameraModel rendered_camera(const SensorNoise& noise, const CameraModel& camera);

/// The same with what belongs to one sensor for all its life drawn once: its depth scale. For flights; training draws a
/// new sensor with every image.
SensorNoise one_sensor(const SensorNoise& noise, std::uint64_t seed);

/// Turns a clean image into what the sensor would give. Same random stream, same image.
/// @param clean    z-depth in metres, 0 = none, as rendered_camera() sees it
/// @param surface  as rendered with `clean`
/// Thread-safe: yes.   Real-time safe: no (allocates when *noisy has another size).
void apply_noise(const SensorNoise& noise, const CameraModel& camera, const DepthImage& clean,
                 const SurfaceImage& surface, Random* random, DepthImage* noisy);

}  // namespace gatefield::scene
