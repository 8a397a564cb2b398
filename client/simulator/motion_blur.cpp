#include "client/simulator/motion_blur.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace gatefield::simulator {
namespace {

constexpr double kSameSurface_px = 0.6;  // at 160 px of width
constexpr double kAgree = 0.7;
constexpr std::size_t kMostMoments = 15;

}  // namespace

void merge_exposure(std::span<const scene::DepthImage> moments, std::span<const scene::SurfaceImage> surfaces,
                    double focal_px, double baseline_m, scene::DepthImage* depth, scene::SurfaceImage* surface) {
  const scene::DepthImage& first = moments.front();
  const std::size_t pixels = first.depth_m.size(), count = std::min(moments.size(), kMostMoments);
  depth->width_px = first.width_px;
  depth->height_px = first.height_px;
  depth->depth_m.resize(pixels);
  surface->cos_incidence.resize(pixels);
  surface->reflectance.resize(pixels);
  const auto scale_px_m = static_cast<float>(focal_px * baseline_m);
  const auto same_px = static_cast<float>(kSameSurface_px * first.width_px / 160.0);
  const auto needed = static_cast<std::ptrdiff_t>(std::ceil(kAgree * static_cast<double>(count)));
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    std::array<std::pair<float, std::size_t>, kMostMoments> disparities;  // with the moment
    for (std::size_t i = 0; i < count; ++i) {
      const float z_m = moments[i].depth_m[pixel];
      disparities[i] = {z_m > 0 ? scale_px_m / z_m : 0.0f, i};
    }
    const auto end = disparities.begin() + static_cast<std::ptrdiff_t>(count);
    const auto median = disparities.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(disparities.begin(), median, end);
    const float middle_px = median->first;
    const std::size_t moment = median->second;
    const auto agreeing = std::count_if(disparities.begin(), end, [middle_px, same_px](const auto& disparity) {
      return std::abs(disparity.first - middle_px) < same_px;
    });
    const bool matched = agreeing >= needed;
    depth->depth_m[pixel] = matched ? moments[moment].depth_m[pixel] : 0.0f;
    surface->cos_incidence[pixel] = matched ? surfaces[moment].cos_incidence[pixel] : 0.0f;
    surface->reflectance[pixel] = matched ? surfaces[moment].reflectance[pixel] : 0.0f;
  }
}

}  // namespace gatefield::simulator
