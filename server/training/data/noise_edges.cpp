#include "server/training/data/noise_edges.h"

#include <algorithm>
#include <cmath>

#include "server/training/data/noise_incidence.h"

namespace gatefield::training {

EdgeFit fit_edges(MeasuredFrames& frames, const DisparityFit& disparity, double incidence_loss, double square_on,
                  double speckle_probability) {
  const float scale_m_px = frames.scale_m_px();
  const double range_m = dataset_camera().max_depth_m - dataset_camera().min_depth_m;
  EdgeFit fit;
  frames.for_each([&](const TrueDepth& truth, const std::vector<float>& measured_m) {
    for (int v = 0; v < kImageHeight_px; ++v) {
      for (int u = 0; u < kImageWidth_px; ++u) {
        const auto i = static_cast<std::size_t>(v * kImageWidth_px + u);
        const float z_m = truth.z_m[i];
        if (z_m <= 0.0f || z_m >= kFarthest_m || truth.border[i] != 0) continue;
        if (truth.shadow[i] != 0) {
          fit.shadow_n += 1.0;
          fit.shadow_expected += kept_part(truth.cosine[i], incidence_loss) * (1.0 - square_on);
          fit.shadow_kept += measured_m[i] > 0.0f ? 1.0 : 0.0;
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
        const float limit = disparity.limit_px(z_m);
        if (!alike || other_m <= 0.0f || other_m >= kFarthest_m) continue;
        if (std::abs(scale_m_px / other_m - scale_m_px / z_m) < 3.0f * limit) continue;
        const float toward = other_m > z_m ? 1.0f : -1.0f;
        const float d_px = scale_m_px / z_m;
        if (d_px - toward * limit <= 0.0f) continue;
        const float just_m = scale_m_px / (d_px - toward * limit);  // what noise alone hardly reaches
        const float hidden = std::clamp((just_m - z_m) / (other_m - z_m), 0.0f, 1.0f);
        // Half of the pixels that bleed take the other depth, half a mixture.
        fit.bleed_expected += 1.0 - 0.5 * static_cast<double>(hidden);
        fit.bleed_n += 1.0;
        const float reached = (measured_m[i] - z_m) / (other_m - z_m);
        const double by_chance =
            speckle_probability * std::clamp(1.25 * static_cast<double>(std::abs(other_m - z_m)) / range_m, 0.0, 1.0);
        if (reached > hidden && reached < 1.25f) fit.bleed += 1.0;
        fit.bleed -= by_chance;
      }
    }
  });
  return fit;
}

}  // namespace gatefield::training
