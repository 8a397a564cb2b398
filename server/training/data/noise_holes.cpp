#include "server/training/data/noise_holes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "server/training/data/noise_incidence.h"

namespace gatefield::training {
namespace {

constexpr int kWindowMargin_px = 8;    ///< from the image's border: holes have their centres inside
constexpr float kWindowCosine = 0.6f;  ///< more slanted surfaces lose too much by themselves

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

/// Least squares of log(missing windows) = log(holes per pixel) + log(missing_windows(radius)).
/// @param part of the windows of each size that miss all pixels; 0 where too few were seen
Holes match_holes(const std::array<double, kWindows>& part, double loss) {
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

}  // namespace

HoleFit fit_holes(MeasuredFrames& frames, double incidence_loss) {
  std::array<double, kWindows> windows{};
  std::array<double, kWindows> empty{};
  std::vector<int> countable(static_cast<std::size_t>((kImageWidth_px + 1) * (kImageHeight_px + 1)), 0);
  std::vector<int> absent = countable;
  double kept = 0.0;
  double could_keep = 0.0;
  const auto corner = [](int u, int v) { return static_cast<std::size_t>(v * (kImageWidth_px + 1) + u); };
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>& measured_m) {
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
        const bool counts = truth.z_m[i] > 0.0f && truth.z_m[i] < kFarthest_m && truth.edge[i] == 0 &&
                            truth.border[i] == 0 && truth.shadow[i] == 0 && truth.cosine[i] > kWindowCosine;
        if (counts) {
          could_keep += kept_part(truth.cosine[i], incidence_loss);
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
  });
  HoleFit fit;
  const double base = could_keep > 0.0 ? kept / could_keep : 1.0;  // what survives besides incidence
  fit.seen = windows.front() > 10.0 * kEnough;
  std::array<double, kWindows> part{};
  for (std::size_t w = 0; w < kWindows; ++w) {
    if (empty[w] >= 30.0) part[w] = empty[w] / windows[w];
  }
  fit.lost_otherwise = 1.0 - base;
  if (fit.seen && part[1] > 0.0) {
    for (int round = 0; round < 3; ++round) {
      fit.holes = match_holes(part, std::clamp(fit.lost_otherwise, 0.0, 0.5));
      fit.lost_otherwise = std::clamp(1.0 - base / (1.0 - fit.holes.covered), 0.0, 1.0);
    }
  }
  return fit;
}

}  // namespace gatefield::training
