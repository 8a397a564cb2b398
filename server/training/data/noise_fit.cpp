#include "server/training/data/noise_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>

#include "server/training/data/true_depth.h"

namespace gatefield::training {
namespace {

constexpr float kFarthest_m = 9.0f;  ///< beyond, noise is cut off by the range's end
constexpr std::size_t kMaxErrors = 4'000'000;
constexpr int kSmallestWindow_px = 3;  ///< windows that holes are looked for with: 3 x 3 to 7 x 7
constexpr std::size_t kWindows = 5;
constexpr int kLargestWindow_px = kSmallestWindow_px + static_cast<int>(kWindows) - 1;
constexpr int kWindowMargin_px = 8;    ///< from the image's border: holes have their centres inside
constexpr float kWindowCosine = 0.6f;  ///< more slanted surfaces lose too much by themselves
constexpr double kEnough = 2000.0;     ///< pixels that a parameter needs

/// An error of the disparity, inside.
struct DisparityError {
  float error_px;
  float measured_px;
  float z_m;  ///< true
};

/// All frames with their truth, one after another.
class Frames {
 public:
  Frames(const Dataset& dataset, const NoiseFitOptions& options) : dataset_(dataset), options_(options) {
    count_ = std::min(dataset.size(), std::max<std::uint64_t>(options.max_frames, 1));
    measured_m_.resize(kImageSize_px);
    if (options.static_scene) find_static_truth();
  }

  std::uint64_t count() const noexcept { return count_; }
  const TrueDepth& static_truth() const noexcept { return truth_; }

  /// fun(truth, measured_m)
  template <typename Fun>
  void for_each(const Fun& fun) {
    for (std::uint64_t i = 0; i < count_; ++i) {
      const SampleView sample = sample_at(i);
      if (!options_.static_scene) {
        std::vector<float>& z_m = clean_m_;
        z_m.resize(kImageSize_px);
        draw_clean(sample, z_m);
        examine(dataset_camera(), options_.baseline_m, z_m, &truth_);
      }
      load(sample);
      fun(truth_, measured_m_);
    }
  }

 private:
  SampleView sample_at(std::uint64_t i) const { return dataset_.at(i * dataset_.size() / count_); }
  void load(const SampleView& sample) {
    for (std::size_t k = 0; k < measured_m_.size(); ++k) {
      measured_m_[k] = 0.001f * static_cast<float>(sample.measured_mm[k]);
    }
  }

  /// Per pixel: mean inverse depth of what lies around the median; nothing when a pixel is there in less than a quarter
  /// of the frames.
  void find_static_truth() {
    std::vector<float> z_m(kImageSize_px, 0.0f);
    std::vector<float> values;
    for (std::size_t k = 0; k < kImageSize_px; ++k) {
      values.clear();
      for (std::uint64_t i = 0; i < count_; ++i) {
        const std::uint16_t mm = sample_at(i).measured_mm[k];
        if (mm > 0) values.push_back(1000.0f / static_cast<float>(mm));
      }
      if (4 * values.size() < count_ || values.empty()) continue;
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      const float median = *middle;
      std::vector<float> away(values.size());
      std::transform(values.begin(), values.end(), away.begin(), [&](float v) { return std::abs(v - median); });
      std::nth_element(away.begin(), away.begin() + static_cast<std::ptrdiff_t>(away.size() / 2), away.end());
      const float limit = std::max(4.0f * 1.4826f * away[away.size() / 2], 0.002f * median);
      double sum = 0.0;
      double n = 0.0;
      for (const float v : values) {
        if (std::abs(v - median) > limit) continue;
        sum += static_cast<double>(v);
        n += 1.0;
      }
      z_m[k] = static_cast<float>(n / sum);
    }
    examine(dataset_camera(), options_.baseline_m, z_m, &truth_);
  }

  const Dataset& dataset_;
  NoiseFitOptions options_;
  std::uint64_t count_ = 0;
  TrueDepth truth_;
  std::vector<float> clean_m_;
  std::vector<float> measured_m_;
};

/// Mean and standard deviation without what lies beyond 3 sigma, corrected for that.
struct Clipped {
  double mean = 0.0;
  double sigma = 0.0;
};

Clipped clipped(const std::vector<DisparityError>& errors) {
  std::vector<float> values(errors.size());
  std::transform(errors.begin(), errors.end(), values.begin(), [](const DisparityError& e) { return e.error_px; });
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  Clipped result{.mean = static_cast<double>(*middle)};
  for (float& v : values) v = std::abs(v - static_cast<float>(result.mean));
  std::nth_element(values.begin(), middle, values.end());
  result.sigma = 1.4826 * static_cast<double>(*middle);
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

/// For a hole somewhere in the image: expected number of windows that miss all their pixels, when those outside of the
/// hole miss with probability `loss`. Over sizes, shapes and directions that apply_noise() draws.
std::array<double, kWindows> missing_windows(double radius_px, double loss) {
  std::array<double, kWindows> sum{};
  std::vector<int> inside;  // sums over all pixels left of and above
  constexpr int kSizes = 6;
  constexpr int kStretches = 5;
  constexpr int kAngles = 4;
  double shift = 0.0;
  for (int i = 0; i < kSizes; ++i) {
    for (int j = 0; j < kStretches; ++j) {
      for (int k = 0; k < kAngles; ++k) {
        const double size_px = radius_px * (0.4 + 1.2 * (i + 0.5) / kSizes);
        const double stretch = std::exp(-0.7 + 1.4 * (j + 0.5) / kStretches);
        const double angle = std::numbers::pi * (k + 0.5) / kAngles;
        const double a_px = size_px * stretch;
        const double b_px = size_px / stretch;
        shift = std::fmod(shift + std::numbers::phi, 1.0);  // where the centre lies in its pixel
        const double other_shift = std::fmod(shift * 37.0, 1.0);
        const int reach = static_cast<int>(std::max(a_px, b_px)) + kLargestWindow_px + 1;
        const int size = 2 * reach + 1;
        const auto at = [&](int u, int v) -> int& { return inside[static_cast<std::size_t>(v * (size + 1) + u)]; };
        inside.assign(static_cast<std::size_t>((size + 1) * (size + 1)), 0);
        for (int v = 0; v < size; ++v) {
          for (int u = 0; u < size; ++u) {
            const double du = u - reach + shift;
            const double dv = v - reach + other_shift;
            const double along = (std::cos(angle) * du + std::sin(angle) * dv) / a_px;
            const double across = (std::cos(angle) * dv - std::sin(angle) * du) / b_px;
            at(u + 1, v + 1) = (along * along + across * across < 1.0 ? 1 : 0) + at(u, v + 1) + at(u + 1, v) - at(u, v);
          }
        }
        for (std::size_t w = 0; w < kWindows; ++w) {
          const int window = kSmallestWindow_px + static_cast<int>(w);
          for (int v = 0; v + window <= size; ++v) {
            for (int u = 0; u + window <= size; ++u) {
              const int covered = at(u + window, v + window) - at(u, v + window) - at(u + window, v) + at(u, v);
              // Windows that only touch the hole are as likely without it.
              if (2 * covered > window * window) sum[w] += std::pow(loss, window * window - covered);
            }
          }
        }
      }
    }
  }
  for (double& s : sum) s /= kSizes * kStretches * kAngles;
  return sum;
}

struct Holes {
  double per_pixel = 0.0;
  double radius_px = 0.0;
  double covered = 0.0;  ///< part of the image
};

/// Least squares of log(missing windows) = log(holes per pixel) + log(missing_windows(radius)).
/// @param part of the windows of each size that miss all pixels; 0 where too few were seen
Holes fit_holes(const std::array<double, kWindows>& part, double loss) {
  Holes best;
  double best_error = 1e300;
  for (double radius_px = 0.8; radius_px < 16.0; radius_px *= 1.03) {
    const std::array<double, kWindows> model = missing_windows(radius_px, loss);
    double n = 0.0;
    double mean = 0.0;
    for (std::size_t w = 0; w < kWindows; ++w) {
      if (part[w] <= 0.0 || model[w] <= 0.0) continue;
      n += 1.0;
      mean += std::log(part[w] / model[w]);
    }
    if (n < 2.0) continue;
    mean /= n;
    double error = 0.0;
    for (std::size_t w = 0; w < kWindows; ++w) {
      if (part[w] <= 0.0) continue;
      const double off = std::log(part[w] / std::max(model[w], 1e-12)) - mean;
      error += off * off;
    }
    if (error < best_error) {
      best_error = error;
      // Mean area: pi E[size^2] with size uniform in 0.4 to 1.6 radii.
      const double area_px = std::numbers::pi * 1.12 * radius_px * radius_px;
      best = {std::exp(mean), radius_px, 1.0 - std::exp(-std::exp(mean) * area_px)};
    }
  }
  return best;
}

std::string text(const char* format, double a, double b = 0.0) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

}  // namespace

Result<NoiseFit> fit_noise(const Dataset& dataset, const NoiseFitOptions& options,
                           const std::function<bool(double part)>& progress) {
  if (dataset.size() == 0) return Error{"the recording has no frames"};
  const SampleView first = dataset.at(0);
  if (first.measured_mm.empty()) {
    return Error{"a data set of kind '" + std::string(name(dataset.kind())) +
                 "' has no measured depth, expected 'stereo' or 'recording'"};
  }
  if (!options.static_scene && first.clean_mm.empty()) {
    return Error{"the recording has no true depth; a recording of a static scene (--static) can do without"};
  }
  if (options.static_scene) {
    if (dataset.size() < 16) {
      return Error{"the recording has " + std::to_string(dataset.size()) +
                   " frames, expected at least 16 of a static scene"};
    }
    for (std::uint64_t i = 0; i < dataset.size(); ++i) {
      const SampleView sample = dataset.at(i);
      if (!sample.X_WC || !first.X_WC) continue;
      const float moved_m = (sample.X_WC->translation() - first.X_WC->translation()).norm();
      if (moved_m > 0.02f) {
        return Error{"frame " + std::to_string(i) + " was taken " + std::to_string(moved_m) +
                     " m from the first one, expected a camera that stands still (--static)"};
      }
    }
  }
  const CameraModel& camera = dataset_camera();
  const auto scale_m_px = static_cast<float>(camera.fx_px * options.baseline_m);
  const scene::SensorNoise defaults;
  NoiseFit fit;
  Frames frames(dataset, options);
  fit.frames = frames.count();
  fit.noise.baseline_m = options.baseline_m;
  int stage = 0;
  const auto go_on = [&] { return !progress || progress(++stage / 3.0); };

  // 1. Errors inside: noise, step, wrong matches.
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
  if (static_cast<double>(errors.size()) < kEnough) {
    return Error{"only " + std::to_string(errors.size()) + " measured pixels lie inside surfaces, expected at least " +
                 std::to_string(static_cast<int>(kEnough))};
  }
  const Clipped spread = clipped(errors);
  fit.bias_px = spread.mean;
  const double step_px = find_step(errors, spread.sigma);
  double rounding = 0.0;  // variance that the millimetres of the file add
  for (const DisparityError& e : errors) {
    const double px_per_mm = 0.001 * static_cast<double>(scale_m_px) / static_cast<double>(e.z_m * e.z_m);
    rounding += px_per_mm * px_per_mm / 12.0 * (options.static_scene ? 1.0 : 2.0);
  }
  rounding /= static_cast<double>(errors.size());
  const double step = std::max(step_px, 0.0);
  fit.noise.disparity_noise_px = std::sqrt(std::max(spread.sigma * spread.sigma - step * step / 12.0 - rounding, 0.0));
  if (fit.noise.disparity_noise_px < 1e-4) fit.noise.disparity_noise_px = 0.0;
  fit.noise.disparity_step_px = step_px >= 0.0 ? step_px : defaults.disparity_step_px;

  const auto limit_px = [&](float z_m) {
    return static_cast<float>(std::max(6.0 * spread.sigma, 0.004) +
                              0.0015 * static_cast<double>(scale_m_px) / static_cast<double>(z_m * z_m));
  };
  double wrong = 0.0;
  double could_be_wrong = 0.0;
  const double range_m = camera.max_depth_m - camera.min_depth_m;
  for (const DisparityError& e : errors) {
    const float off_px = limit_px(e.z_m);
    if (std::abs(e.error_px - static_cast<float>(spread.mean)) > off_px) wrong += 1.0;
    const float d_px = scale_m_px / e.z_m;
    const double nearest_m = std::max(static_cast<double>(scale_m_px / (d_px + off_px)), camera.min_depth_m);
    const double farthest_m = d_px > off_px
                                  ? std::min(static_cast<double>(scale_m_px / (d_px - off_px)), camera.max_depth_m)
                                  : camera.max_depth_m;
    could_be_wrong += 1.0 - std::clamp((farthest_m - nearest_m) / range_m, 0.0, 1.0);
  }
  const bool speckle_seen = could_be_wrong > kEnough;
  fit.noise.speckle_probability = speckle_seen ? wrong / could_be_wrong : defaults.speckle_probability;
  if (!go_on()) return Error{"stopped"};

  // 2. Missing pixels inside against incidence.
  constexpr int kBins = 20;
  std::array<double, kBins> seen{};
  std::array<double, kBins> missing{};
  std::array<double, kBins> where{};
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>& measured_m) {
    for (std::size_t i = 0; i < kImageSize_px; ++i) {
      if (truth.inside[i] == 0 || truth.shadow[i] != 0 || truth.z_m[i] >= kFarthest_m) continue;
      const double slant = 1.0 - static_cast<double>(truth.cosine[i]);
      const double x = slant * slant * slant;
      const auto bin = static_cast<std::size_t>(std::min(x * kBins, kBins - 1.0));
      seen[bin] += 1.0;
      where[bin] += x;
      missing[bin] += measured_m[i] <= 0.0f ? 1.0 : 0.0;
    }
  });
  double sw = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, slanted_n = 0.0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    if (seen[bin] <= 0.0) continue;
    const double x = where[bin] / seen[bin];
    const double y = missing[bin] / seen[bin];
    const double weight = std::min(seen[bin], 1e5);  // so that what is seen square on does not decide alone
    sw += weight;
    sx += weight * x;
    sy += weight * y;
    sxx += weight * x * x;
    sxy += weight * x * y;
    if (x > 0.1) slanted_n += seen[bin];
  }
  const double spread_x = sxx - sx * sx / sw;
  const bool incidence_seen = slanted_n > kEnough && spread_x > 0.0;
  double slope = incidence_seen ? (sxy - sx * sy / sw) / spread_x : 0.0;
  const double square_on = std::clamp((sy - slope * sx) / sw, 0.0, 0.99);  // part that is missing at 0 deg
  slope = std::clamp(slope / (1.0 - square_on), 0.0, 1.0);
  fit.noise.incidence_loss = incidence_seen ? slope : defaults.incidence_loss;
  const auto keep = [&](float cosine) {
    const double slant = 1.0 - static_cast<double>(cosine);
    return 1.0 - fit.noise.incidence_loss * slant * slant * slant;
  };
  if (!go_on()) return Error{"stopped"};

  // 3. Holes, edges, shadows.
  std::array<double, kWindows> windows{};
  std::array<double, kWindows> empty{};
  std::vector<int> countable(static_cast<std::size_t>((kImageWidth_px + 1) * (kImageHeight_px + 1)), 0);
  std::vector<int> absent = countable;
  double kept = 0.0;
  double could_keep = 0.0;
  double bleed = 0.0, bleed_expected = 0.0, bleed_n = 0.0;
  double shadow_kept = 0.0, shadow_expected = 0.0, shadow_n = 0.0;
  const auto corner = [](int u, int v) { return static_cast<std::size_t>(v * (kImageWidth_px + 1) + u); };
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>& measured_m) {
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
        const bool counts = truth.z_m[i] > 0.0f && truth.z_m[i] < kFarthest_m && truth.edge[i] == 0 &&
                            truth.border[i] == 0 && truth.shadow[i] == 0 && truth.cosine[i] > kWindowCosine;
        if (counts) {
          could_keep += keep(truth.cosine[i]);
          kept += measured_m[i] > 0.0f ? 1.0 : 0.0;
        }
        const auto accumulate = [&](std::vector<int>* sums, bool one) {
          (*sums)[corner(u + 1, v + 1)] =
              (one ? 1 : 0) + (*sums)[corner(u, v + 1)] + (*sums)[corner(u + 1, v)] - (*sums)[corner(u, v)];
        };
        accumulate(&countable, counts);
        accumulate(&absent, counts && measured_m[i] <= 0.0f);
      }
    }
    for (std::size_t w = 0; w < kWindows; ++w) {
      const int window = kSmallestWindow_px + static_cast<int>(w);
      for (int v = kWindowMargin_px; v + window <= kImageHeight_px - kWindowMargin_px; ++v) {
        for (int u = kWindowMargin_px; u + window <= kImageWidth_px - kWindowMargin_px; ++u) {
          const auto total = [&](const std::vector<int>& sums) {
            return sums[corner(u + window, v + window)] - sums[corner(u, v + window)] - sums[corner(u + window, v)] +
                   sums[corner(u, v)];
          };
          if (total(countable) != window * window) continue;
          windows[w] += 1.0;
          if (total(absent) == window * window) empty[w] += 1.0;
        }
      }
    }
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
        const float z_m = truth.z_m[i];
        if (z_m <= 0.0f || z_m >= kFarthest_m || truth.border[i] != 0) continue;
        if (truth.shadow[i] != 0) {
          shadow_n += 1.0;
          shadow_expected += keep(truth.cosine[i]) * (1.0 - square_on);
          shadow_kept += measured_m[i] > 0.0f ? 1.0 : 0.0;
        }
        if (truth.edge[i] == 0 || measured_m[i] <= 0.0f) continue;
        // Only where all neighbours across the edge are about equally far, and far enough to be told from noise.
        float other_m = 0.0f;
        bool alike = true;
        const auto look = [&](bool there, std::size_t at) {
          if (!there || !TrueDepth::differs(z_m, truth.z_m[at])) return;
          if (other_m > 0.0f && std::abs(truth.z_m[at] - other_m) > 0.05f * other_m) alike = false;
          other_m = truth.z_m[at];
        };
        look(u > 0, i - 1);
        look(u + 1 < kImageWidth_px, i + 1);
        look(v > 0, i - kImageWidth_px);
        look(v + 1 < kImageHeight_px, i + kImageWidth_px);
        const float limit = limit_px(z_m);
        if (!alike || other_m <= 0.0f || other_m >= kFarthest_m) continue;
        if (std::abs(scale_m_px / other_m - scale_m_px / z_m) < 3.0f * limit) continue;
        const float toward = other_m > z_m ? 1.0f : -1.0f;
        const float d_px = scale_m_px / z_m;
        if (d_px - toward * limit <= 0.0f) continue;
        const float just_m = scale_m_px / (d_px - toward * limit);  // what noise alone hardly reaches
        const float hidden = std::clamp((just_m - z_m) / (other_m - z_m), 0.0f, 1.0f);
        // Half of the pixels that bleed take the other depth, half a mixture.
        bleed_expected += 1.0 - 0.5 * static_cast<double>(hidden);
        bleed_n += 1.0;
        const float reached = (measured_m[i] - z_m) / (other_m - z_m);
        const double by_chance = fit.noise.speckle_probability *
                                 std::clamp(1.25 * static_cast<double>(std::abs(other_m - z_m)) / range_m, 0.0, 1.0);
        if (reached > hidden && reached < 1.25f) bleed += 1.0;
        bleed -= by_chance;
      }
    }
  });
  const double base = could_keep > 0.0 ? kept / could_keep : 1.0;  // what survives besides incidence
  const bool holes_seen = windows.front() > 10.0 * kEnough;
  std::array<double, kWindows> part{};
  for (std::size_t w = 0; w < kWindows; ++w) {
    if (empty[w] >= 30.0) part[w] = empty[w] / windows[w];
  }
  Holes holes;
  double lost_otherwise = 1.0 - base;
  if (holes_seen && part[1] > 0.0) {
    for (int round = 0; round < 3; ++round) {
      holes = fit_holes(part, std::clamp(lost_otherwise, 0.0, 0.5));
      lost_otherwise = std::clamp(1.0 - base / (1.0 - holes.covered), 0.0, 1.0);
    }
  }
  const bool any_holes = holes.covered > 2e-4;
  if (holes_seen) {
    fit.noise.hole_rate_per_image = any_holes ? std::min(holes.per_pixel * kImageSize_px, 100.0) : 0.0;
  }
  if (any_holes) fit.noise.hole_radius_px = holes.radius_px;
  const bool all_there = holes_seen && lost_otherwise < 0.003;
  if (all_there) fit.noise.reflectance_loss = 0.0;
  const bool bleed_seen = bleed_expected > 0.25 * kEnough;
  fit.noise.bleed_probability = bleed_seen ? std::clamp(bleed / bleed_expected, 0.0, 1.0) : defaults.bleed_probability;
  const bool shadow_seen = shadow_expected > 0.25 * kEnough;
  fit.noise.shadow_probability =
      shadow_seen ? std::clamp(1.0 - shadow_kept / shadow_expected, 0.0, 1.0) : defaults.shadow_probability;

  const auto put = [&](const char* field, double value, bool fitted, const std::string& says) {
    fit.parameters.push_back({field, value, fitted, says});
  };
  const double n = static_cast<double>(errors.size());
  put("baseline_m", fit.noise.baseline_m, false, "as given: depth does not tell it");
  put("disparity_noise_px", fit.noise.disparity_noise_px, true,
      text("fitted to %.0f pixels inside surfaces; mean error %+.4f px", n, fit.bias_px));
  put("disparity_step_px", fit.noise.disparity_step_px, step_px >= 0.0,
      step_px > 0.0    ? std::string("fitted: disparities are multiples of it")
      : step_px == 0.0 ? std::string("none found down to 0.001 px")
                       : std::string("default: too few pixels between 2.5 and 8 m"));
  put("bleed_probability", fit.noise.bleed_probability, bleed_seen,
      bleed_seen ? text("fitted to %.0f pixels at edges", bleed_n)
                 : text("default: only %.0f pixels at edges can be told from noise", bleed_n));
  put("shadow_probability", fit.noise.shadow_probability, shadow_seen,
      shadow_seen ? text("fitted to %.0f pixels hidden from the second imager", shadow_n)
                  : text("default: only %.0f pixels are hidden from the second imager", shadow_n));
  put("hole_rate_per_image", fit.noise.hole_rate_per_image, holes_seen,
      holes_seen ? text("fitted: holes cover %.2f %% of the image", 100.0 * (any_holes ? holes.covered : 0.0))
                 : std::string("default: too few pixels"));
  put("hole_radius_px", fit.noise.hole_radius_px, any_holes,
      !any_holes                                  ? std::string("default: there are no holes to measure")
      : holes.radius_px > 2.0 * kLargestWindow_px ? std::string("fitted, but so large holes are hardly told apart")
                                                  : std::string("fitted"));
  put("speckle_probability", fit.noise.speckle_probability, speckle_seen,
      speckle_seen ? text("fitted: %.0f of %.0f pixels inside are beyond 6 sigma", wrong, n)
                   : std::string("default: noise covers the range"));
  put("incidence_loss", fit.noise.incidence_loss, incidence_seen,
      incidence_seen ? text("fitted to %.0f pixels at more than 57 deg", slanted_n)
                     : text("default: only %.0f pixels at more than 57 deg", slanted_n));
  put("reflectance_loss", fit.noise.reflectance_loss, all_there,
      all_there ? std::string("nothing is missing but by holes and incidence")
                : text("default: a recording does not hold reflectance (%.1f %% are missing for other reasons)",
                       100.0 * lost_otherwise));
  put("scale", fit.noise.scale, false, "1 by definition");
  if (!go_on()) return Error{"stopped"};
  return fit;
}

std::string to_text(const NoiseFit& fit) {
  std::string out = text("%.0f frames\n", static_cast<double>(fit.frames));
  for (const FittedParameter& p : fit.parameters) {
    char line[300];
    std::snprintf(line, sizeof line, "%-20s %9.5g  %s\n", p.field.c_str(), p.value, p.says.c_str());
    out += line;
  }
  return out;
}

}  // namespace gatefield::training
