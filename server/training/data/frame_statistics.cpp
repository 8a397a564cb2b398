#include "server/training/data/frame_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/base/statistics.h"
#include "server/training/data/surface_estimate.h"

namespace gatefield::training {
namespace {

constexpr float kFlat_px = 2.0f;  ///< surroundings of a hole inside a surface span less
constexpr float kIsland_px = 5.0f;
constexpr double kLargeHole_px2 = 20.0, kSingleHole_px2 = 2.0;  ///< at 160 pixels' width, fx 84.3
constexpr double kSmallImage_px = 84.3;
constexpr std::size_t kEnoughWindows = 20;

/// One disparity image.
struct Image {
  int width, height;
  std::span<const float> d_px;

  float at(int u, int v) const { return d_px[static_cast<std::size_t>(v) * width + u]; }
};

/// Holes as connected pieces (4 neighbours), without the left band.
void count_holes(const SensorGeometry& geometry, const Image& image, const std::vector<int>& first, double* lost,
                 double* large, double* single, FrameStatistics* out) {
  const double scale_px = geometry.scale_px();
  const double small_px2 = std::pow(kSmallImage_px / geometry.camera.fx_px, 2);  // an image's pixel at 160 wide
  std::vector<std::uint8_t> seen(image.d_px.size(), 0);
  std::vector<std::size_t> piece;
  const auto width = static_cast<std::size_t>(image.width);
  for (int v = 0; v < image.height; ++v)
    for (int u = first[static_cast<std::size_t>(v)]; u < image.width; ++u) {
      const std::size_t begin = static_cast<std::size_t>(v) * width + u;
      if (image.d_px[begin] > 0.0f || seen[begin] != 0) continue;
      piece.assign(1, begin);
      seen[begin] = 1;
      float low = 1e9f, high = 0.0f;
      bool border = false;
      for (std::size_t k = 0; k < piece.size(); ++k) {
        const int pu = static_cast<int>(piece[k] % width), pv = static_cast<int>(piece[k] / width);
        for (const auto& [du, dv] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          const int nu = pu + du, nv = pv + dv;
          if (nu < 0 || nv < 0 || nu >= image.width || nv >= image.height || nu < first[static_cast<std::size_t>(nv)]) {
            border = true;
            continue;
          }
          const std::size_t next = static_cast<std::size_t>(nv) * width + nu;
          const float d = image.d_px[next];
          if (d > 0.0f) {
            low = std::min(low, d);
            high = std::max(high, d);
          } else if (seen[next] == 0) {
            seen[next] = 1;
            piece.push_back(next);
          }
        }
      }
      const auto area = static_cast<double>(piece.size());
      *lost += area;
      if (area * small_px2 > kLargeHole_px2) *large += area;
      if (area * small_px2 < kSingleHole_px2) *single += area;
      if (!border && high - low < kFlat_px) {
        out->lost_inside += area;
        out->inside_area_px2.push_back(area / (scale_px * scale_px));
      }
    }
}

/// Jumps along one line, from pixel to pixel or across a hole: use(jump, hole), the jump signed and less what the
/// surfaces beside it slope, the hole in image pixels.
template <typename At, typename Use>
void for_each_jump(int count, const At& at, const Use& use) {
  const auto slope_between = [&](int a, int b) {
    return a >= 0 && b < count && at(a) > 0.0f && at(b) > 0.0f ? static_cast<double>(std::abs(at(b) - at(a))) : 0.0;
  };
  int last = -1;
  for (int k = 0; k < count; ++k) {
    if (at(k) <= 0.0f) continue;
    if (last >= 0) {
      const auto step = static_cast<double>(at(k) - at(last));
      const double slope = std::min(slope_between(last - 1, last), slope_between(k, k + 1));
      use(std::copysign(std::max(0.0, std::abs(step) - slope * (k - last)), step), k - last - 1);
    }
    last = k;
  }
}

void count_jumps(const SensorGeometry& geometry, const Image& image, FrameStatistics* out) {
  const double scale_px = geometry.scale_px();
  const int longest = image_pixels(15.0, scale_px, 3);  // what is longer is more than a jump
  const auto add = [&](double jump_px, int hole) {
    for (std::size_t bin = 0; bin < kJumpBins; ++bin) {
      if (jump_px < kJumps_px[bin] || jump_px >= kJumps_px[bin + 1]) continue;
      out->jump_n[bin] += 1.0;
      out->jump_holes[bin] += hole > 0 ? 1.0 : 0.0;
    }
  };
  for (int v = 0; v < image.height; ++v) {
    for_each_jump(
        image.width, [&](int u) { return image.at(u, v); },
        [&](double jump_px, int hole) {
          const double hole_px = hole / scale_px;
          if (jump_px < 0.0 && hole <= longest) {
            add(-jump_px, hole);
            if (jump_px < -2.0 && hole > 0) out->gap_px.push_back(hole_px);
          } else if (jump_px > 3.0 && hole_px < 30.0 + jump_px) {
            out->shadow_px.push_back(hole_px - jump_px);
          }
        });
  }
  for (int u = 0; u < image.width; ++u) {
    for_each_jump(
        image.height, [&](int v) { return image.at(u, v); },
        [&](double jump_px, int hole) {
          if (hole > longest) return;
          add(std::abs(jump_px), hole);
          if (std::abs(jump_px) > 2.0 && hole > 0) out->above_px.push_back(hole / scale_px);
        });
  }
}

/// First measured column of each row, in image pixels, and what that says of the left band.
std::vector<int> find_band(const SensorGeometry& geometry, const Image& image, std::vector<double>* excess_px) {
  const double scale_px = geometry.scale_px();
  std::vector<int> first;
  for (int v = 0; v < image.height; ++v) {
    int u = 0;
    while (u < image.width && image.at(u, v) <= 0.0f) ++u;
    const bool band = u < image.width && u / scale_px < 0.25 * image.width / scale_px;
    excess_px->push_back(band ? u / scale_px - static_cast<double>(image.at(u, v)) : std::nan(""));
    first.push_back(band ? u : 0);
  }
  return first;
}

/// Rows over which the band's edge is alike, sensor pixels: where the correlation of differences falls to a half.
double rows_alike(const std::vector<std::vector<double>>& excess_px, double median_px, double limit_px,
                  double scale_px) {
  double before = 1.0, variance = 0.0, n = 0.0;
  const auto good = [&](double x) { return std::isfinite(x) && std::abs(x - median_px) < limit_px; };
  for (const auto& rows : excess_px)
    for (const double x : rows)
      if (good(x)) {
        variance += (x - median_px) * (x - median_px);
        n += 1.0;
      }
  if (n < 100.0 || variance <= 0.0) return std::nan("");
  variance /= n;
  for (int lag = 1; lag < 40; ++lag) {
    double sum = 0.0, pairs = 0.0;
    for (const auto& rows : excess_px)
      for (std::size_t v = 0; v + static_cast<std::size_t>(lag) < rows.size(); ++v) {
        const double a = rows[v], b = rows[v + static_cast<std::size_t>(lag)];
        if (!good(a) || !good(b)) continue;
        sum += (a - median_px) * (b - median_px);
        pairs += 1.0;
      }
    const double correlation = pairs > 0.0 ? sum / pairs / variance : 0.0;
    if (correlation < 0.5) return (lag - 1 + (before - 0.5) / std::max(before - correlation, 1e-9)) / scale_px;
    before = correlation;
  }
  return 40.0 / scale_px;
}

}  // namespace

FrameStatistics measure_frames(const SensorGeometry& geometry, const std::vector<std::vector<float>>& frames) {
  FrameStatistics out;
  out.frames = frames.size();
  const CameraModel& camera = geometry.camera;
  const auto focal_baseline = static_cast<double>(geometry.focal_baseline());
  const auto z_of = [&](double d_px) { return focal_baseline / d_px; };
  const double scale_px = geometry.scale_px();
  FlatWindows all;
  std::vector<FlatWindows> by_frame(frames.size());
  std::vector<std::vector<double>> bands;
  double pixels = 0.0, rows = 0.0, outside = 0.0, large = 0.0, single = 0.0, slant = 0.0, slant_n = 0.0;
  std::vector<float> d_px;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    d_px.clear();
    for (const float z_m : frames[f]) d_px.push_back(z_m > 0.0f ? geometry.focal_baseline() / z_m : 0.0f);
    const Image image{camera.width_px, camera.height_px, d_px};
    collect_windows(geometry, d_px, z_of, &by_frame[f]);
    bands.emplace_back();
    const std::vector<int> first = find_band(geometry, image, &bands.back());
    for (const int u : first) out.lost_left += u;
    count_holes(geometry, image, first, &outside, &large, &single, &out);
    count_jumps(geometry, image, &out);
    pixels += static_cast<double>(d_px.size());
    rows += image.height;
    for (int v = 1; v + 1 < image.height; ++v) {
      const auto empty = [&](int row) {
        for (int u = 0; u < image.width; ++u)
          if (image.at(u, row) > 0.0f) return false;
        return true;
      };
      if (empty(v) && (!empty(v - 1) || !empty(v + 1))) out.rows_lost += 1.0;
    }
    const int reach = cosine_reach(geometry);
    for (int v = reach; v + reach < image.height; ++v)
      for (int u = reach; u + reach < image.width; ++u) {
        const float d = image.at(u, v);
        if (d <= 0.0f) continue;
        if (z_of(static_cast<double>(d)) > camera.max_depth_m) out.beyond += 1.0;
        bool island = true;
        for (int dv = -1; dv <= 1; ++dv)
          for (int du = -1; du <= 1; ++du) {
            const float other = image.at(u + du, v + dv);
            if ((du != 0 || dv != 0) && other > 0.0f && std::abs(other - d) <= kIsland_px) island = false;
          }
        out.islands += island ? 1.0 : 0.0;
        if ((u + v) % 7 != 0) continue;
        const double cosine = cosine_at(geometry, d_px, u, v);
        if (!std::isfinite(cosine)) continue;
        slant += std::pow(1.0 - cosine, 3);
        slant_n += 1.0;
      }
    all.add(by_frame[f]);
  }
  for (std::size_t bin = 0; bin < kBins; ++bin) out.flat[bin] = all.moments(bin);
  for (const FlatWindows& frame : by_frame) {
    double sum = 0.0, n = 0.0;
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      const auto& values = frame.px2[bin][1];
      if (values.size() < kEnoughWindows) continue;
      const auto windows = static_cast<double>(values.size());
      sum += windows * 0.5 * std::log(lower_mean(values) / out.flat[bin].px2[1]);
      n += windows;
    }
    if (n > 0.0) out.gain.push_back(std::exp(sum / n));
  }
  out.lost = (out.lost_left + outside) / pixels;
  out.lost_left /= pixels;
  out.lost_inside /= pixels;
  out.lost_large = outside > 0.0 ? large / outside : 0.0;
  out.lost_single = outside > 0.0 ? single / outside : 0.0;
  out.beyond /= pixels;
  out.islands /= pixels;
  out.rows_lost /= rows;
  out.slant = slant_n > 0.0 ? slant / slant_n : 0.0;

  std::vector<double> excess_px, away_px;
  for (const auto& band : bands)
    for (const double x : band)
      if (std::isfinite(x)) excess_px.push_back(x);
  out.band_px = quantile(excess_px, 0.5);
  for (const double x : excess_px) away_px.push_back(std::abs(x - out.band_px));
  out.band_sigma_px = 1.4826 * quantile(away_px, 0.5);
  out.band_rows_px = rows_alike(bands, out.band_px, std::max(3.0 * out.band_sigma_px, 1.0), scale_px);
  return out;
}

}  // namespace gatefield::training
