#include "common/scene/active_stereo_losses.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/random.h"
#include "common/scene/noise_planes.h"

namespace gatefield::scene {
namespace {

/// A jump in disparity that is no slope.
constexpr float kJump_px = 0.5f;
/// What the surfaces beside a jump may slope from pixel to pixel and have taken off it.
constexpr float kSlope_px = 1.0f;

constexpr float unit(std::uint32_t bits) noexcept { return static_cast<float>(bits >> 8) * 0x1p-24f; }

/// Uniform in 0 to 1 from a normal: neighbours share it as they share the normal.
float uniform_of(float normal) noexcept { return 0.5f * std::erfc(-normal / std::numbers::sqrt2_v<float>); }

/// Holes along one line of pixels `stride` apart.
class Line {
 public:
  Line(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, std::span<const float> d_px,
       std::span<float> depth_m)
      : noise_(noise), scale_px_(static_cast<float>(scale_px)), draws_(draws), d_px_(d_px), depth_m_(depth_m) {}

  /// @param horizontal  the far side right of a jump has widths of its own
  void lose(std::size_t first, std::size_t stride, int count, bool horizontal) {
    for (int k = 0; k + 1 < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k) * stride;
      const float here = d_px_[i], there = d_px_[i + stride];
      if (here <= 0.0f || there <= 0.0f || std::abs(here - there) < kJump_px) continue;
      const float before = k > 0 && d_px_[i - stride] > 0.0f ? std::abs(here - d_px_[i - stride]) : 0.0f;
      const float after =
          k + 2 < count && d_px_[i + 2 * stride] > 0.0f ? std::abs(there - d_px_[i + 2 * stride]) : 0.0f;
      const float jump = std::abs(here - there) - std::min({before, after, kSlope_px});
      if (jump < kJump_px) continue;
      const auto probability =
          static_cast<float>(1.0 / (1.0 + std::exp((noise_.edge_step_px - jump) / noise_.edge_slope_px)));
      if (uniform_of(draws_.ragged[i]) >= probability) continue;
      const bool far_after = there < here;
      const bool right = horizontal && far_after;
      const auto low = static_cast<float>(right ? noise_.right_width_min_px : noise_.edge_width_min_px);
      const auto high = static_cast<float>(right ? noise_.right_width_max_px : noise_.edge_width_max_px);
      const float width_px = low + (high - low) * unit(draws_.other_bits[i]);
      const int lost = static_cast<int>(width_px * scale_px_ + unit(draws_.bits[i]));
      const float limit = std::min(here, there) + 0.5f * std::abs(here - there);
      for (int n = 0; n < lost; ++n) {
        const int at = far_after ? k + 1 + n : k - n;
        if (at < 0 || at >= count) break;
        const std::size_t pixel = first + static_cast<std::size_t>(at) * stride;
        if (d_px_[pixel] > limit) break;  // something near again
        depth_m_[pixel] = 0.0f;
      }
    }
  }

 private:
  const ActiveStereoNoise& noise_;
  float scale_px_;
  const ImageDraws& draws_;
  std::span<const float> d_px_;
  std::span<float> depth_m_;
};

}  // namespace

void ImageDraws::draw(const ActiveStereoNoise& noise, double scale_px, int width, int height,
                      std::array<std::uint32_t, 2> key) {
  // A blur of sigma s has neighbours alike over about 2 s.
  draw_field(key, kRagged, width, height, 0.5 * noise.ragged_px * scale_px, &ragged);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t blocks = (pixels + 1) / 2;
  static thread_local std::vector<std::uint32_t> drawn;
  drawn.resize(4 * blocks);
  fill_bits(key[0], key[1], kWhite, blocks, drawn.data(), drawn.data() + blocks, drawn.data() + 2 * blocks,
            drawn.data() + 3 * blocks);
  bits.assign(drawn.begin(), drawn.begin() + static_cast<std::ptrdiff_t>(pixels));
  other_bits.assign(drawn.begin() + static_cast<std::ptrdiff_t>(2 * blocks),
                    drawn.begin() + static_cast<std::ptrdiff_t>(2 * blocks + pixels));
  const float* const table = normal_table().data();
  white.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) white[i] = table[bits[i] & (kNormals - 1)];
}

void fatten(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
            std::vector<float>* d_px) {
  const auto reach_px = static_cast<float>(noise.fatten_px * scale_px);
  if (reach_px <= 0.0f) return;
  const std::vector<float> before = *d_px;
  const auto jump = static_cast<float>(noise.edge_step_px);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * width + u;
      if (before[i] <= 0.0f) continue;
      // Half as much to one and a half times, ragged as other edges are; parts of a pixel by chance.
      const float grown_px = reach_px * (0.5f + uniform_of(draws.ragged[i]));
      const int steps = static_cast<int>(grown_px + unit(draws.other_bits[i]));
      float nearest = before[i];
      for (int k = 1; k <= steps; ++k) {
        for (const auto& [du, dv] : {std::array{-k, 0}, {k, 0}, {0, -k}, {0, k}}) {
          if (u + du < 0 || u + du >= width || v + dv < 0 || v + dv >= height) continue;
          const float other = before[static_cast<std::size_t>(v + dv) * width + (u + du)];
          if (other - before[i] > jump) nearest = std::max(nearest, other);
        }
      }
      (*d_px)[i] = nearest;
    }
  }
}

void lose_edges(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
                std::span<const float> d_px, std::span<float> depth_m) {
  Line line(noise, scale_px, draws, d_px, depth_m);
  const auto stride = static_cast<std::size_t>(width);
  for (int v = 0; v < height; ++v) line.lose(static_cast<std::size_t>(v) * stride, 1, width, true);
  for (int u = 0; u < width; ++u) line.lose(static_cast<std::size_t>(u), stride, height, false);
}

void lose_hidden(const ActiveStereoNoise& noise, double scale_px, const ImageDraws& draws, int width, int height,
                 std::span<const float> d_px, std::span<float> depth_m) {
  const auto to_image = static_cast<float>(scale_px);
  const auto jump = static_cast<float>(noise.edge_step_px);
  for (int v = 0; v < height; ++v) {
    const std::size_t row = static_cast<std::size_t>(v) * width;
    const auto band_px =
        static_cast<float>(noise.band_px + noise.band_sigma_px * static_cast<double>(draws.ragged[row]));
    // From right to left: hidden is what the second imager, to the right, has at or right of what it saw already.
    float leftmost_px = 1e9f, end_px = 1e9f, before = 0.0f;
    for (int u = width - 1; u >= 0; --u) {
      const std::size_t i = row + static_cast<std::size_t>(u);
      const float d = d_px[i];
      if (d <= 0.0f) continue;
      if (before - d > jump) {
        const double extra_px = noise.shadow_extra_px + noise.shadow_sigma_px * static_cast<double>(draws.ragged[i]);
        end_px = leftmost_px - to_image * static_cast<float>(extra_px);
      }
      before = d;
      const float second_px = static_cast<float>(u) - to_image * d;
      if (second_px >= end_px || static_cast<float>(u) + 0.5f < to_image * (d + band_px)) {
        depth_m[i] = 0.0f;
      } else {
        leftmost_px = std::min(leftmost_px, second_px);
        end_px = leftmost_px;
      }
    }
  }
}

void lose_at_random(const ActiveStereoNoise& noise, double scale, double scale_px, const CameraModel& camera,
                    const SurfaceImage& surface, const ImageDraws& draws, std::array<std::uint32_t, 2> key,
                    DepthImage* noisy) {
  const int width = noisy->width_px, height = noisy->height_px;
  std::vector<float>& depth_m = noisy->depth_m;
  const std::uint64_t drawn_key = (std::uint64_t{key[1]} << 32) | key[0];

  const auto speckle = static_cast<float>(scale * noise.speckle_probability);
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    if (depth_m[i] > 0.0f && unit(draws.bits[i]) < speckle)
      depth_m[i] = static_cast<float>(camera.min_depth_m + (camera.max_depth_m - camera.min_depth_m) *
                                                               static_cast<double>(unit(draws.other_bits[i])));
  }

  Random patches(drawn_key, kPatches);
  const double log_span = std::log(noise.patch_area_max_px2 / noise.patch_area_min_px2);
  const double mean_px2 =
      log_span > 1e-9 ? (noise.patch_area_max_px2 - noise.patch_area_min_px2) / log_span : noise.patch_area_min_px2;
  const double image_px2 = static_cast<double>(depth_m.size()) / (scale_px * scale_px);
  for (int n = poisson(scale * noise.patch_loss * image_px2 / mean_px2, &patches); n > 0; --n) {
    const int u0 = static_cast<int>(patches.below(static_cast<std::uint32_t>(width)));
    const int v0 = static_cast<int>(patches.below(static_cast<std::uint32_t>(height)));
    const double area_px2 = noise.patch_area_min_px2 * std::exp(log_span * patches.uniform()) * scale_px * scale_px;
    const double keep = patches.uniform(), part = patches.uniform();
    const std::size_t middle = static_cast<std::size_t>(v0) * width + u0;
    const double slant = 1.0 - static_cast<double>(surface.cos_incidence[middle]);
    const double darkness = 1.0 - static_cast<double>(surface.reflectance[middle]);
    if (keep >= std::max(slant * slant * slant, darkness * darkness * darkness)) continue;
    if (area_px2 < 1.0) {
      if (part < area_px2) depth_m[middle] = 0.0f;
      continue;
    }
    const double radius_px = std::sqrt(area_px2 / std::numbers::pi);
    const int reach = static_cast<int>(2.0 * radius_px) + 1;
    for (int v = std::max(0, v0 - reach); v <= std::min(height - 1, v0 + reach); ++v) {
      for (int u = std::max(0, u0 - reach); u <= std::min(width - 1, u0 + reach); ++u) {
        const std::size_t i = static_cast<std::size_t>(v) * width + u;
        const double edge_px = radius_px * (1.0 + 0.35 * static_cast<double>(draws.ragged[i]));
        if (std::hypot(u - u0, v - v0) < edge_px) depth_m[i] = 0.0f;
      }
    }
  }

  Random rows(drawn_key, kLostRows);
  for (int n = poisson(scale * noise.row_loss_rate, &rows); n > 0; --n) {
    const int first = static_cast<int>(rows.below(static_cast<std::uint32_t>(height)));
    const int count = 1 + static_cast<int>(rows.uniform() * noise.row_loss_height_px * scale_px);
    for (int v = first; v < std::min(height, first + count); ++v)
      std::fill_n(depth_m.begin() + static_cast<std::ptrdiff_t>(v) * width, width, 0.0f);
  }
}

}  // namespace gatefield::scene
