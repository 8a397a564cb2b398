#include "server/training/data/flat_windows.h"

#include <algorithm>
#include <cmath>

namespace gatefield::training {
namespace {

constexpr float kFlat_px = 2.0f;   ///< residuals in a flat window span less
constexpr double kMeasured = 0.9;  ///< part of it that has depth

/// One disparity image.
struct Image {
  int width, height;
  std::span<const float> d_px;

  float at(int u, int v) const { return d_px[static_cast<std::size_t>(v) * width + u]; }
};

/// Second moments of one window, px^2; none when it is not flat.
struct Window {
  bool flat = false;
  double mean_px = 0.0, variance_px2 = 0.0;
  std::vector<float> residual;  ///< [side * side], NaN where nothing was measured
};

Window examine(const Image& image, int u0, int v0, int side) {
  Window window;
  // Least squares of d = a + b x + c y: x and y from the window's middle, over what was measured.
  double n = 0, x1 = 0, y1 = 0, d1 = 0, xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const auto d = static_cast<double>(image.at(u0 + i, v0 + j));
      if (d <= 0.0) continue;
      const double x = i - 0.5 * (side - 1), y = j - 0.5 * (side - 1);
      n += 1;
      x1 += x;
      y1 += y;
      d1 += d;
      xx += x * x;
      xy += x * y;
      yy += y * y;
      xd += x * d;
      yd += y * d;
    }
  if (n < kMeasured * side * side) return window;
  const double sxx = xx - x1 * x1 / n, sxy = xy - x1 * y1 / n, syy = yy - y1 * y1 / n;
  const double sxd = xd - x1 * d1 / n, syd = yd - y1 * d1 / n;
  const double determinant = sxx * syy - sxy * sxy;
  if (determinant <= 0.0) return window;
  const double b = (sxd * syy - syd * sxy) / determinant, c = (syd * sxx - sxd * sxy) / determinant;
  const double a = (d1 - b * x1 - c * y1) / n;
  window.residual.assign(static_cast<std::size_t>(side) * side, std::nanf(""));
  float low = 1e9f, high = -1e9f;
  double squares = 0.0;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const auto d = static_cast<double>(image.at(u0 + i, v0 + j));
      if (d <= 0.0) continue;
      const double e = d - (a + b * (i - 0.5 * (side - 1)) + c * (j - 0.5 * (side - 1)));
      window.residual[static_cast<std::size_t>(j) * side + i] = static_cast<float>(e);
      low = std::min(low, static_cast<float>(e));
      high = std::max(high, static_cast<float>(e));
      squares += e * e;
    }
  window.flat = high - low < kFlat_px;
  window.mean_px = d1 / n;
  window.variance_px2 = squares / (n - 3.0);
  return window;
}

/// Half the mean square of differences `lag` pixels apart in rows.
double half_difference(const std::vector<float>& residual, int side, int lag) {
  double sum = 0.0, n = 0.0;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i + lag < side; ++i) {
      const std::size_t at = static_cast<std::size_t>(j) * side + i;
      const auto e = static_cast<double>(residual[at + static_cast<std::size_t>(lag)] - residual[at]);
      if (!std::isfinite(e)) continue;
      sum += 0.5 * e * e;
      n += 1.0;
    }
  return n > 0.0 ? sum / n : std::nan("");
}

std::size_t bin_of(double z_m) {
  std::size_t bin = kBins;
  for (std::size_t i = 0; i < kBins; ++i)
    if (z_m >= kStatisticsFrom_m[i]) bin = i;
  return bin;
}

}  // namespace

int image_pixels(double sensor_px, double scale_px, int least) noexcept {
  return std::max(least, static_cast<int>(std::lround(sensor_px * scale_px)));
}

void FlatWindows::add(const FlatWindows& others) {
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    distance_sum_m[bin] += others.distance_sum_m[bin];
    for (std::size_t k = 0; k < kMoments; ++k)
      px2[bin][k].insert(px2[bin][k].end(), others.px2[bin][k].begin(), others.px2[bin][k].end());
  }
}

double lower_mean(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  const std::size_t n = std::max<std::size_t>(1, values.size() * 3 / 4);
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) sum += values[i];
  return sum / static_cast<double>(n);
}

FlatMoments FlatWindows::moments(std::size_t bin) const {
  FlatMoments out;
  out.windows = px2[bin][1].size();
  out.at_m = out.windows > 0 ? distance_sum_m[bin] / static_cast<double>(out.windows) : 0.0;
  for (std::size_t k = 0; k < kMoments; ++k) out.px2[k] = lower_mean(px2[bin][k]);
  return out;
}

void collect_windows(const SensorGeometry& geometry, std::span<const float> d_px,
                     const std::function<double(double)>& z_of, FlatWindows* all) {
  const Image image{geometry.camera.width_px, geometry.camera.height_px, d_px};
  const double scale_px = geometry.scale_px();
  for (std::size_t w = 0; w < kWindows_px.size(); ++w) {
    const int side = image_pixels(kWindows_px[w], scale_px, 3);
    const int stride = std::max(1, side / 2);
    for (int v = 0; v + side <= image.height; v += stride)
      for (int u = 0; u + side <= image.width; u += stride) {
        const Window window = examine(image, u, v, side);
        if (!window.flat) continue;
        const double z_m = z_of(window.mean_px);
        const std::size_t bin = bin_of(z_m);
        if (bin >= kBins) continue;
        all->px2[bin][w].push_back(window.variance_px2);
        if (w != 1) continue;
        all->distance_sum_m[bin] += z_m;
        for (std::size_t k = 0; k < kLags_px.size(); ++k) {
          const double moment = half_difference(window.residual, side, image_pixels(kLags_px[k], scale_px, 1));
          if (std::isfinite(moment)) all->px2[bin][kWindows_px.size() + k].push_back(moment);
        }
      }
  }
}

}  // namespace gatefield::training
