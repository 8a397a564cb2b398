#include "server/training/data/cloud_fit.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <map>
#include <numbers>
#include <span>

#include "common/scene/noise_planes.h"

namespace gatefield::training {
namespace {

constexpr std::array kSmall_px{2.5, 3.5, 4.5, 6.0};
constexpr std::array kLarge_px{8.0, 10.0, 13.0, 17.0};
constexpr std::size_t kEnoughWindows = 40;
constexpr int kFields = 6;
using Moments = std::array<double, kMoments>;

/// Moments of a field of unit variance whose blur has this sigma, sensor pixels.
Moments response(const SensorGeometry& geometry, double radius_px) {
  constexpr float kAt_px = 10.0f, kUnit_px = 0.05f;  // small enough for every window to be flat
  FlatWindows windows;
  std::vector<float> field;
  for (std::uint32_t k = 0; k < kFields; ++k) {
    scene::draw_field({k, 0x66697473}, 0, geometry.camera.width_px, geometry.camera.height_px,
                      radius_px * geometry.scale_px(), &field);
    for (float& value : field) value = kAt_px + kUnit_px * value;
    collect_windows(
        geometry, field, [](double) { return 1.5; }, &windows);
  }
  Moments moments{};
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const FlatMoments seen = windows.moments(bin);
    if (seen.windows == 0) continue;
    for (std::size_t k = 0; k < kMoments; ++k)
      moments[k] = seen.px2[k] / static_cast<double>(kUnit_px) / static_cast<double>(kUnit_px);
  }
  return moments;
}

struct Parts {
  std::array<double, 3> px2{};  ///< white, small, large: variances
  double misfit = 0.0;          ///< sum of squares of relative errors
};

/// Least squares of measured[k] = sum of px2[j] parts[j][k] in relative errors, none negative: of all choices of parts
/// that may be there the best that has no negative one.
Parts explain(const Moments& measured, const std::array<Moments, 3>& parts) {
  Parts best;
  best.misfit = std::numeric_limits<double>::infinity();
  for (unsigned choice = 1; choice < 8; ++choice) {
    Eigen::Matrix3d normal = 1e-12 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < kMoments; ++k) {
      if (!(measured[k] > 0.0)) continue;
      Eigen::Vector3d row = Eigen::Vector3d::Zero();
      for (unsigned j = 0; j < 3; ++j)
        if ((choice >> j & 1u) != 0) row[j] = parts[j][k] / measured[k];
      normal += row * row.transpose();
      right += row;
    }
    const Eigen::Vector3d px2 = normal.ldlt().solve(right);
    if (!px2.allFinite() || px2.minCoeff() < -1e-12) continue;
    Parts tried;
    for (unsigned j = 0; j < 3; ++j) tried.px2[j] = std::max(0.0, px2[j]);
    for (std::size_t k = 0; k < kMoments; ++k) {
      if (!(measured[k] > 0.0)) continue;
      double sum = 0.0;
      for (unsigned j = 0; j < 3; ++j) sum += tried.px2[j] * parts[j][k];
      tried.misfit += std::pow(sum / measured[k] - 1.0, 2);
    }
    if (tried.misfit < best.misfit) best = tried;
  }
  return best;
}

}  // namespace

Result<CloudFit> fit_clouds(const SensorGeometry& geometry, const std::array<FlatMoments, kBins>& flat,
                            double gain_square, double step_px) {
  std::vector<std::size_t> bins;
  CloudFit best;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    if (flat[bin].windows >= kEnoughWindows) {
      bins.push_back(bin);
      best.windows += flat[bin].windows;
    }
  if (bins.empty()) {
    return Error{
        "no distance shows " + std::to_string(kEnoughWindows) + " flat windows, expected frames with walls or floors",
        ErrorCode::kInvalid};
  }
  std::map<double, Moments> responses;
  responses[0.0] = response(geometry, 0.0);
  for (const double radius_px : kSmall_px) responses[radius_px] = response(geometry, radius_px);
  for (const double radius_px : kLarge_px) responses[radius_px] = response(geometry, radius_px);
  double least = std::numeric_limits<double>::infinity();
  for (const double small_px : kSmall_px)
    for (const double large_px : kLarge_px) {
      const std::array parts{responses[0.0], responses[small_px], responses[large_px]};
      double misfit = 0.0, white_px2 = 0.0, weight = 0.0;
      std::vector<scene::ActiveStereoNoise::Cloud> clouds;
      for (const std::size_t bin : bins) {
        const Parts found = explain(flat[bin].px2, parts);
        const double share = std::sqrt(static_cast<double>(flat[bin].windows));
        misfit += share * found.misfit;
        weight += share;
        white_px2 += share * found.px2[0];
        clouds.push_back(
            {flat[bin].at_m, std::sqrt(found.px2[1] / gain_square), std::sqrt(found.px2[2] / gain_square)});
      }
      if (misfit >= least) continue;
      least = misfit;
      const double step_px2 = step_px * step_px / 12.0;
      best.small_radius_px = small_px;
      best.large_radius_px = large_px;
      best.white_px = std::sqrt(std::max(0.0, white_px2 / weight - step_px2) / gain_square);
      best.clouds = clouds;
      best.misfit = std::sqrt(misfit / weight / static_cast<double>(kMoments));
    }
  return best;
}

double find_step(const SensorGeometry& geometry, const std::vector<std::vector<float>>& frames) {
  constexpr float kFrom_m = 0.8f, kTo_m = 3.0f;
  constexpr std::size_t kPixels = 2000;
  constexpr double kClear = 0.4;  // of 2000 random phases 0.02
  std::vector<double> inverse_1_m;
  std::size_t there = 0;
  const auto used = [&](float z_m) { return z_m >= kFrom_m && z_m <= kTo_m; };
  for (const auto& frame : frames) there += static_cast<std::size_t>(std::ranges::count_if(frame, used));
  const std::size_t every = std::max<std::size_t>(1, there / kPixels);
  std::size_t n = 0;
  for (const auto& frame : frames)
    for (const float z_m : frame)
      if (used(z_m) && n++ % every == 0) inverse_1_m.push_back(1.0 / static_cast<double>(z_m));
  if (inverse_1_m.size() < kPixels / 2) return 0.0;
  // With disparities k step, k whole, step_m / z is whole for step_m = focal baseline / step.
  const auto clear = [&](double step_m) {
    std::complex<double> sum = 0.0;
    for (const double x : inverse_1_m) sum += std::polar(1.0, 2.0 * std::numbers::pi * step_m * x);
    return std::abs(sum) / static_cast<double>(inverse_1_m.size());
  };
  const double focal_baseline = static_cast<double>(geometry.focal_baseline());
  const double from_m = focal_baseline / 1.0, to_m = focal_baseline / 0.01;
  constexpr double kGrid_m = 0.2;  // phases between 0.8 and 3 m turn by less than a quarter from one to the next
  double best_m = 0.0, best = kClear;
  for (double step_m = from_m; step_m < to_m; step_m += kGrid_m) {
    const double now = clear(step_m);
    // A multiple is as clear as the step itself, which comes first.
    if (now > best + (best_m > 0.0 ? 0.1 : 0.0)) {
      best = now;
      best_m = step_m;
    }
  }
  if (best_m <= 0.0) return 0.0;
  for (double around_m = best_m - kGrid_m; around_m < best_m + kGrid_m; around_m += 0.01) {
    const double now = clear(around_m);
    if (now > best) {
      best = now;
      best_m = around_m;
    }
  }
  return focal_baseline / best_m;
}

}  // namespace gatefield::training
