#include "server/training/data/noise_disparity.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "common/base/statistics.h"

namespace gatefield::training {
namespace {

constexpr std::size_t kMaxErrors = 4'000'000;

/// An error of the disparity, inside.
struct DisparityError {
  float error_px;
  float measured_px;
  float z_m;  ///< true
};

/// Mean and standard deviation without what lies beyond 3 sigma, corrected for that.
struct Clipped {
  double mean = 0.0;
  double sigma = 0.0;
};

Clipped clipped(const std::vector<DisparityError>& errors) {
  std::vector<float> values(errors.size());
  std::transform(errors.begin(), errors.end(), values.begin(), [](const DisparityError& e) { return e.error_px; });
  Clipped result{.mean = static_cast<double>(quantile_in_place(std::span(values), 0.5))};
  for (float& v : values) v = std::abs(v - static_cast<float>(result.mean));
  result.sigma = 1.4826 * static_cast<double>(quantile_in_place(std::span(values), 0.5));
  for (int round = 0; round < 12; ++round) {
    // A noise without spread still has the millimetres of the file.
    const double limit = 3.0 * result.sigma + 1e-4;
    double n = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    for (const DisparityError& e : errors) {
      const double off = static_cast<double>(e.error_px) - result.mean;
      if (std::abs(off) > limit) continue;
      n += 1.0;
      sum += off;
      squares += off * off;
    }
    if (n < 2.0) break;
    constexpr double kClippedAt3 = 0.98658;  // standard deviation of a normal number within 3 sigma
    const double mean = sum / n;
    result.mean += mean;
    result.sigma = std::sqrt(std::max(squares / n - mean * mean, 0.0)) / kClippedAt3;
  }
  return result;
}

/// Largest step of which the disparities are multiples, 0 when there is none, < 0 when one can't tell.
/// @param sigma_px of all errors; a step makes at least step / sqrt(12) of it
double find_step(const std::vector<DisparityError>& errors, double sigma_px) {
  // 2.5 to 8 m: nearer, the file's millimetres are coarser than the steps looked for.
  std::vector<double> d_px;
  for (const DisparityError& e : errors) {
    if (e.z_m >= 2.5f && e.z_m <= 8.0f && d_px.size() < 20'000) d_px.push_back(static_cast<double>(e.measured_px));
  }
  if (static_cast<double>(d_px.size()) < kEnough) return -1.0;
  const double top_px = *std::max_element(d_px.begin(), d_px.end());
  const std::size_t few = std::min<std::size_t>(d_px.size(), 2000);
  const auto strength = [&](double step_px, std::size_t n) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += std::cos(2.0 * std::numbers::pi * d_px[i * d_px.size() / n] / step_px);
    }
    return sum / static_cast<double>(n);
  };
  constexpr double kFinest_px = 0.001;
  double best_step = 0.0;
  // From coarse to fine: the first that stands out is the step itself, its halves and thirds would follow.
  for (double step_px = 3.6 * sigma_px; step_px > kFinest_px; step_px -= step_px * step_px / (8.0 * top_px)) {
    if (strength(step_px, few) < 0.5) continue;
    double best = -1.0;
    const double width_px = step_px * step_px / (2.0 * top_px);
    for (int k = -40; k <= 40; ++k) {
      const double tried_px = step_px + width_px * k / 40.0;
      const double value = strength(tried_px, d_px.size());
      if (value > best) {
        best = value;
        best_step = tried_px;
      }
    }
    if (best > 0.6) return best_step;
  }
  return 0.0;
}

/// Variance that the millimetres of the file add, mean over the errors. @param images  that are rounded: both or one
double rounding_of(const std::vector<DisparityError>& errors, float scale_m_px, double images) {
  double sum = 0.0;
  for (const DisparityError& e : errors) {
    const double px_per_mm = 0.001 * static_cast<double>(scale_m_px) / static_cast<double>(e.z_m * e.z_m);
    sum += px_per_mm * px_per_mm / 12.0 * images;
  }
  return sum / static_cast<double>(errors.size());
}

/// At most about kMaxErrors of them, evenly taken.
std::vector<DisparityError> errors_inside(MeasuredFrames& frames) {
  const float scale_m_px = frames.scale_m_px();
  std::vector<DisparityError> errors;
  double inside_n = 0.0;
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>&) {
    for (std::size_t i = 0; i < kImageSize_px; ++i) {
      inside_n += truth.inside[i] != 0 && truth.shadow[i] == 0 && truth.z_m[i] < kFarthest_m ? 1.0 : 0.0;
    }
  });
  const auto every = static_cast<std::size_t>(inside_n / static_cast<double>(kMaxErrors)) + 1;
  std::size_t turn = 0;
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>& measured_m) {
    for (std::size_t i = 0; i < kImageSize_px; ++i) {
      const float z_m = truth.z_m[i];
      if (truth.inside[i] == 0 || truth.shadow[i] != 0 || z_m >= kFarthest_m || measured_m[i] <= 0.0f) continue;
      if (++turn % every != 0) continue;
      const float measured_px = scale_m_px / measured_m[i];
      errors.push_back({measured_px - scale_m_px / z_m, measured_px, z_m});
    }
  });
  return errors;
}

}  // namespace

float DisparityFit::limit_px(float z_m) const noexcept {
  return static_cast<float>(std::max(6.0 * spread_px, 0.004) +
                            0.0015 * static_cast<double>(scale_m_px) / static_cast<double>(z_m * z_m));
}

Result<DisparityFit> fit_disparity(MeasuredFrames& frames) {
  const std::vector<DisparityError> errors = errors_inside(frames);
  if (static_cast<double>(errors.size()) < kEnough) {
    return Error{"only " + std::to_string(errors.size()) + " measured pixels lie inside surfaces, expected at least " +
                 std::to_string(static_cast<int>(kEnough))};
  }
  const Clipped spread = clipped(errors);
  DisparityFit fit;
  fit.scale_m_px = frames.scale_m_px();
  fit.pixels = static_cast<double>(errors.size());
  fit.bias_px = spread.mean;
  fit.spread_px = spread.sigma;
  fit.step_px = find_step(errors, spread.sigma);
  const double rounding = rounding_of(errors, fit.scale_m_px, frames.static_scene() ? 1.0 : 2.0);
  const double step = std::max(fit.step_px, 0.0);
  fit.noise_px = std::sqrt(std::max(spread.sigma * spread.sigma - step * step / 12.0 - rounding, 0.0));
  if (fit.noise_px < 1e-4) fit.noise_px = 0.0;

  const CameraModel& camera = dataset_camera();
  const double range_m = camera.max_depth_m - camera.min_depth_m;
  for (const DisparityError& e : errors) {
    const float off_px = fit.limit_px(e.z_m);
    if (std::abs(e.error_px - static_cast<float>(spread.mean)) > off_px) fit.wrong += 1.0;
    const float d_px = fit.scale_m_px / e.z_m;
    const double nearest_m = std::max(static_cast<double>(fit.scale_m_px / (d_px + off_px)), camera.min_depth_m);
    const double farthest_m = d_px > off_px
                                  ? std::min(static_cast<double>(fit.scale_m_px / (d_px - off_px)), camera.max_depth_m)
                                  : camera.max_depth_m;
    fit.could_be_wrong += 1.0 - std::clamp((farthest_m - nearest_m) / range_m, 0.0, 1.0);
  }
  return fit;
}

}  // namespace gatefield::training
