#include "server/training/data/surface_estimate.h"

#include <algorithm>
#include <cmath>

namespace gatefield::training {
namespace {

constexpr double kReach_px = 24.0;
constexpr float kSame_px = 1.0f;

constexpr double kSlope_px = 8.0;  ///< across which slopes are taken
constexpr float kFlat_px = 2.0f;   ///< what spans more there is a jump

}  // namespace

int cosine_reach(const SensorGeometry& geometry) { return image_pixels(kSlope_px, geometry.scale_px(), 2); }

double cosine_at(const SensorGeometry& geometry, std::span<const float> d_px, int u, int v) {
  const CameraModel& camera = geometry.camera;
  const int reach = cosine_reach(geometry);
  const auto at = [&](int du, int dv) { return d_px[static_cast<std::size_t>(v + dv) * camera.width_px + (u + du)]; };
  const float here = at(0, 0), left = at(-reach, 0), right = at(reach, 0), above = at(0, -reach), below = at(0, reach);
  const auto [low, high] = std::minmax({here, left, right, above, below});
  if (low <= 0.0f || high - low > kFlat_px) return std::nan("");
  // A plane is d = a + b x + c y with x and y in focal lengths from the middle; its normal is along (b, c, a).
  const Eigen::Vector3d ray = camera.ray_C(u, v);
  const double b = 0.5 * static_cast<double>(right - left) / reach * camera.fx_px;
  const double c = 0.5 * static_cast<double>(below - above) / reach * camera.fy_px;
  const Eigen::Vector3d normal(b, c, static_cast<double>(here) - b * ray.x() - c * ray.y());
  return std::abs(normal.dot(ray)) / (normal.norm() * ray.norm());
}

std::vector<float> surface_cosines(const SensorGeometry& geometry, const std::vector<float>& depth_m) {
  const int width = geometry.camera.width_px, height = geometry.camera.height_px;
  const int reach = cosine_reach(geometry);
  std::vector<float> d_px, cosines(depth_m.size(), 1.0f);
  for (const float z_m : depth_m) d_px.push_back(z_m > 0.0f ? geometry.focal_baseline() / z_m : 0.0f);
  for (int v = reach; v + reach < height; ++v)
    for (int u = reach; u + reach < width; ++u) {
      const double cosine = cosine_at(geometry, d_px, u, v);
      if (std::isfinite(cosine)) cosines[static_cast<std::size_t>(v) * width + u] = static_cast<float>(cosine);
    }
  return cosines;
}

std::vector<float> fill_holes(const std::vector<float>& depth_m, int width_px) {
  std::vector<float> filled = depth_m;
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t row = 0; row + width <= filled.size(); row += width) {
    for (std::size_t u = 0; u < width;) {
      if (filled[row + u] > 0.0f) {
        ++u;
        continue;
      }
      std::size_t end = u;
      while (end < width && filled[row + end] <= 0.0f) ++end;
      const float left_m = u > 0 ? filled[row + u - 1] : 0.0f;
      const float right_m = end < width ? filled[row + end] : 0.0f;
      std::fill(filled.begin() + static_cast<std::ptrdiff_t>(row + u),
                filled.begin() + static_cast<std::ptrdiff_t>(row + end), std::max(left_m, right_m));
      u = end;
    }
  }
  return filled;
}

std::vector<float> estimate_surfaces(const SensorGeometry& geometry, const std::vector<float>& depth_m) {
  const int width = geometry.camera.width_px, height = geometry.camera.height_px;
  std::vector<float> d_px = fill_holes(depth_m, width);
  for (float& value : d_px) value = value > 0.0f ? geometry.focal_baseline() / value : 0.0f;
  const int reach = image_pixels(kReach_px, geometry.scale_px(), 2);
  const int stride = std::max(1, reach / 6);  // samples are enough: what is averaged is smooth
  std::vector<float> out(d_px.size());
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * width + u;
      if (d_px[i] <= 0.0f) continue;
      // In pairs opposite of each other: a slope has no say in the mean.
      float sum = d_px[i], n = 1.0f;
      for (int dv = -reach; dv <= reach; dv += stride)
        for (int du = -reach; du <= reach; du += stride) {
          if (u + du < 0 || u + du >= width || v + dv < 0 || v + dv >= height) continue;
          if (u - du < 0 || u - du >= width || v - dv < 0 || v - dv >= height) continue;
          const float a = d_px[static_cast<std::size_t>(v + dv) * width + (u + du)];
          const float b = d_px[static_cast<std::size_t>(v - dv) * width + (u - du)];
          const float middle = 0.5f * (a + b);
          if (std::min(a, b) <= 0.0f || std::abs(middle - d_px[i]) > kSame_px || std::abs(a - b) > 8.0f * kSame_px)
            continue;
          sum += middle;
          n += 1.0f;
        }
      out[i] = geometry.focal_baseline() * n / sum;
    }
  return out;
}

}  // namespace gatefield::training
