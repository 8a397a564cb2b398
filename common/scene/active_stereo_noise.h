#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/scene/depth_camera.h"

namespace gatefield::scene {

/// What an active stereo camera really does to depth, as measured on recordings of one (docs/sensor-noise.md): errors
/// come in clouds that grow with distance, holes have ragged edges and lie along jumps, surfaces beyond the range come
/// and go. All pixels are the sensor's own, of focal length focal_px, whatever the image was decimated to:
/// disparity d = focal_px baseline_m / z. The defaults are a D435's; active_stereo_fields() says where each comes from.
struct ActiveStereoNoise {
  double focal_px = 383.0;
  double baseline_m = 0.05;

  /// Sigma of the disparity's error at a distance, apart by the size of its blobs; straight lines between distances.
  struct Cloud {
    double at_m = 0.0;
    double small_px = 0.0;
    double large_px = 0.0;
  };
  std::vector<Cloud> clouds = {{1, 0.04, 0.03}, {2, 0.06, 0.04}, {3, 0.12, 0.12},
                               {4, 0.15, 0.30}, {6, 0.20, 0.45}, {10, 0.20, 0.45}};
  double small_radius_px = 4.5;
  double large_radius_px = 10.0;
  double gain_min = 0.5;
  double gain_max = 2.0;
  double white_px = 0.03;
  double step_px = 0.03125;

  double smooth_window_px = 15.0;
  double smooth_sigma_px = 5.0;
  double smooth_below_px = 2.0;

  double edge_step_px = 2.5;
  double edge_slope_px = 0.5;
  double edge_width_min_px = 1.0;
  double edge_width_max_px = 3.0;
  double right_width_min_px = 2.0;
  double right_width_max_px = 6.0;
  double fatten_px = 0.0;

  double shadow_extra_px = 1.8;
  double shadow_sigma_px = 3.0;
  double band_px = 6.5;
  double band_sigma_px = 2.2;
  double ragged_px = 3.0;

  double patch_loss = 0.08;
  double patch_area_min_px2 = 1.0;
  double patch_area_max_px2 = 1000.0;
  double speckle_probability = 0.0003;

  double depth_scale_min = 0.97;
  double depth_scale_max = 1.03;
  double readout_s = 0.0;
  double turn_rad_s = 10.0;
  double row_loss_rate = 0.02;
  double row_loss_height_px = 24.0;
  double render_to_m = 25.0;
};

/// One number of the model: its name as in files, its range, what it does, where its default comes from.
struct ActiveStereoField {
  const char* name;
  double ActiveStereoNoise::*value;
  double low, high;
  const char* does;
  const char* source;
};
/// All but `clouds`, in the order of the struct.
std::span<const ActiveStereoField> active_stereo_fields() noexcept;

/// Says which field is wrong and why. Errors: kInvalid with the field ("noise.active_stereo.white_px").
Status validate(const ActiveStereoNoise& noise);

/// Sigma of both kinds of clouds at a distance, px. @pre noise.clouds is not empty and in order of distance
ActiveStereoNoise::Cloud cloud_at(const ActiveStereoNoise& noise, double z_m) noexcept;

/// Turns a clean image into what such a sensor would give, in this order (s = the image's pixels a sensor's):
///  1. rows taken one after another while the camera turns: row v shows the scene of (v / height - 1/2) readout_s
///  2. near surfaces grow over far ones by fatten_px
///  3. where d spans less than smooth_below_px within smooth_window_px, it is blurred: small jumps become ramps
///  4. d += gain (a1(z) G1 + a2(z) G2 + white); G of draw_field(), radii times s; then whole steps
///  5. a jump of D px, after what the surfaces beside it slope, has a hole on its far side with probability
///     1 / (1 + exp((edge_step - D) / edge_slope)); below 0.5 px it is none
///  6. what the second imager can't see, shadow_extra +- shadow_sigma longer; what lies left of its image:
///     u < d + band +- band_sigma
///  7. patches on slanting and dark surfaces, wrong matches, lost rows
///  8. z = depth_scale focal baseline / d; beyond the camera's range it is lost, as it is only now: surfaces beyond it
///     should be in `clean` up to render_to_m
/// @param scale  of the errors and losses of 4 and 7 and of the depth scale's deviation from 1
/// @param key    names the image: same key, same noise
/// Thread-safe: yes.   Real-time safe: no.
void apply_active_stereo(const ActiveStereoNoise& noise, double scale, const CameraModel& camera,
                         const DepthImage& clean, const SurfaceImage& surface, std::array<std::uint32_t, 2> key,
                         DepthImage* noisy);

}  // namespace gatefield::scene
