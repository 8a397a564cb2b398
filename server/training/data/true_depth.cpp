#include "server/training/data/true_depth.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gatefield::training {
namespace {

/// Slope of 1 / z per pixel along one direction: over three pixels where it is straight (a plane, however steep), else
/// over two that are about equally far, else 0.
float slope(const float* z_m, std::ptrdiff_t stride, int at, int size) {
  static constexpr std::array<std::array<int, 3>, 4> kTriples = {{{-2, 0, 2}, {-1, 0, 1}, {0, 1, 2}, {-2, -1, 0}}};
  for (const auto& [a, b, c] : kTriples) {
    if (at + a < 0 || at + c >= size) continue;
    const float za_m = z_m[a * stride];
    const float zb_m = z_m[b * stride];
    const float zc_m = z_m[c * stride];
    if (za_m <= 0.0f || zb_m <= 0.0f || zc_m <= 0.0f) continue;
    const float bend = 1.0f / za_m - 2.0f / zb_m + 1.0f / zc_m;
    if (std::abs(bend) < 0.01f / zb_m) return (1.0f / zc_m - 1.0f / za_m) / static_cast<float>(c - a);
  }
  for (const int side : {-1, 1}) {
    if (at + side < 0 || at + side >= size) continue;
    const float other_m = z_m[side * stride];
    if (other_m <= 0.0f || TrueDepth::differs(z_m[0], other_m)) continue;
    return static_cast<float>(side) * (1.0f / other_m - 1.0f / z_m[0]);
  }
  return 0.0f;
}

}  // namespace

bool TrueDepth::differs(float z_m, float other_m) noexcept { return std::abs(other_m - z_m) > 0.1f + 0.03f * z_m; }

void examine(const CameraModel& camera, double baseline_m, std::span<const float> z_m, TrueDepth* truth) {
  const int width = camera.width_px;
  const int height = camera.height_px;
  const std::size_t pixels = z_m.size();
  truth->z_m.assign(z_m.begin(), z_m.end());
  truth->cosine.assign(pixels, 0.0f);
  truth->edge.assign(pixels, 0);
  truth->border.assign(pixels, 0);
  truth->inside.assign(pixels, 1);
  truth->shadow.assign(pixels, 0);
  const auto index = [width](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };

  const auto disparity_m_px = static_cast<float>(camera.fx_px * baseline_m);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::size_t i = index(u, v);
      const float here_m = z_m[i];
      if (here_m <= 0.0f) {
        truth->inside[i] = 0;
        continue;
      }
      const auto look = [&](int du, int dv) {
        if (u + du < 0 || u + du >= width || v + dv < 0 || v + dv >= height) return;
        const float other_m = z_m[index(u + du, v + dv)];
        if (TrueDepth::differs(here_m, other_m)) truth->edge[i] = 1;
        if (other_m <= 0.0f) truth->border[i] = 1;
      };
      look(-1, 0);
      look(1, 0);
      look(0, -1);
      look(0, 1);
      // On a plane 1 / z is linear in x and y, and the coefficients are the normal's direction.
      const float per_z = 1.0f / here_m;
      const auto x = static_cast<float>((u + 0.5 - camera.cx_px) / camera.fx_px);
      const auto y = static_cast<float>((v + 0.5 - camera.cy_px) / camera.fy_px);
      const float nx = slope(z_m.data() + i, 1, u, width) * static_cast<float>(camera.fx_px);
      const float ny = slope(z_m.data() + i, width, v, height) * static_cast<float>(camera.fy_px);
      const float nz = per_z - nx * x - ny * y;
      truth->cosine[i] =
          std::min(per_z / (std::sqrt(nx * nx + ny * ny + nz * nz) * std::sqrt(1.0f + x * x + y * y)), 1.0f);
    }
    // From right to left: hidden is what the second imager sees no further left than all before it.
    float leftmost_px = 1e9f;
    for (int u = width - 1; u >= 0; --u) {
      const std::size_t i = index(u, v);
      if (z_m[i] <= 0.0f) continue;
      const float second_px = static_cast<float>(u) - disparity_m_px / std::max(z_m[i], 1e-3f);
      if (second_px >= leftmost_px) {
        truth->shadow[i] = 1;
      } else {
        leftmost_px = second_px;
      }
    }
  }
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::size_t i = index(u, v);
      if (z_m[i] > 0.0f && truth->edge[i] == 0) continue;
      for (int dv = -TrueDepth::kInside_px; dv <= TrueDepth::kInside_px; ++dv) {
        for (int du = -TrueDepth::kInside_px; du <= TrueDepth::kInside_px; ++du) {
          if (u + du >= 0 && u + du < width && v + dv >= 0 && v + dv < height) truth->inside[index(u + du, v + dv)] = 0;
        }
      }
    }
  }
}

}  // namespace gatefield::training
