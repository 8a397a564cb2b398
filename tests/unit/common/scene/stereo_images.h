#pragma once

#include <functional>
#include <vector>

#include "common/scene/active_stereo_noise.h"

/// Images that an active stereo sensor of our own sees, and its disparities.
namespace gatefield::scene {

inline constexpr double kFocalBaseline = 383.0 * 0.05;

/// The sensor's own images, not decimated: a pixel of the image is one of the sensor's.
inline CameraModel sensor_camera(int width_px = 640, int height_px = 480) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = camera.fy_px = 383.0;
  camera.cx_px = 0.5 * width_px;
  camera.cy_px = 0.5 * height_px;
  camera.max_depth_m = 100.0;
  return camera;
}

using DisparityOf = std::function<double(int u, int v)>;

inline DepthImage image_of(const CameraModel& camera, const DisparityOf& d_px) {
  DepthImage image{camera.width_px, camera.height_px, {}};
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      const double d = d_px(u, v);
      image.depth_m.push_back(d > 0.0 ? static_cast<float>(kFocalBaseline / d) : 0.0f);
    }
  return image;
}

inline SurfaceImage surface_of(const DepthImage& image, float cosine = 1.0f, float reflectance = 1.0f) {
  return {std::vector<float>(image.depth_m.size(), cosine), std::vector<float>(image.depth_m.size(), reflectance)};
}

/// Everything off; tests switch on what they look at.
inline ActiveStereoNoise silent() {
  ActiveStereoNoise noise;
  noise.clouds = {{1.0, 0.0, 0.0}};
  noise.gain_min = noise.gain_max = 1.0;
  noise.white_px = noise.step_px = 0.0;
  noise.smooth_below_px = 0.0;
  noise.edge_step_px = 100.0;
  noise.shadow_extra_px = noise.shadow_sigma_px = 0.0;
  noise.band_px = -1000.0;
  noise.band_sigma_px = 0.0;
  noise.patch_loss = noise.speckle_probability = noise.row_loss_rate = 0.0;
  noise.depth_scale_min = noise.depth_scale_max = 1.0;
  return noise;
}

inline std::vector<float> disparities(const ActiveStereoNoise& noise, const CameraModel& camera,
                                      const DepthImage& clean, std::uint32_t image = 1, double scale = 1.0) {
  DepthImage noisy;
  apply_active_stereo(noise, scale, camera, clean, surface_of(clean), {image, 77}, &noisy);
  for (float& z : noisy.depth_m) z = z > 0.0f ? static_cast<float>(kFocalBaseline) / z : 0.0f;
  return noisy.depth_m;
}

}  // namespace gatefield::scene
