#include "server/training/data/noise_incidence.h"

#include <algorithm>
#include <array>

namespace gatefield::training {

double kept_part(float cosine, double loss) noexcept {
  const double slant = 1.0 - static_cast<double>(cosine);
  return 1.0 - loss * slant * slant * slant;
}

IncidenceFit fit_incidence(MeasuredFrames& frames) {
  IncidenceFit fit;
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
  double sw = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0;
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
    if (x > 0.1) fit.slanted_n += seen[bin];
  }
  const double spread_x = sxx - sx * sx / sw;
  fit.seen = fit.slanted_n > kEnough && spread_x > 0.0;
  const double slope = fit.seen ? (sxy - sx * sy / sw) / spread_x : 0.0;
  fit.square_on = std::clamp((sy - slope * sx) / sw, 0.0, 0.99);
  fit.loss = std::clamp(slope / (1.0 - fit.square_on), 0.0, 1.0);
  return fit;
}

}  // namespace gatefield::training
