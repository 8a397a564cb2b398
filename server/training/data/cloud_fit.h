#pragma once

#include <array>
#include <vector>

#include "common/base/result.h"
#include "common/scene/active_stereo_noise.h"
#include "server/training/data/flat_windows.h"

/// The clouds of an active stereo sensor from the moments of flat windows. Not for use outside of this folder.
namespace gatefield::training {

struct CloudFit {
  double small_radius_px = 0.0, large_radius_px = 0.0, white_px = 0.0;
  std::vector<scene::ActiveStereoNoise::Cloud> clouds;  ///< at the distances with enough windows
  double misfit = 0.0;  ///< root mean square of (model - measured) / measured over all moments
  std::size_t windows = 0;
};

/// @param gain_square  mean square of the images' gains, taken out of the sigmas
/// @param step_px      of the disparities: its share of the white part is taken out
/// Errors: no distance has enough flat windows.   Thread-safe: yes.   Real-time safe: no.
Result<CloudFit> fit_clouds(const SensorGeometry& geometry, const std::array<FlatMoments, kBins>& flat,
                            double gain_square, double step_px);

/// Step of the disparity: the largest of which the disparities between 0.8 and 3 m are multiples, px; 0: none is seen.
double find_step(const SensorGeometry& geometry, const std::vector<std::vector<float>>& frames);

}  // namespace gatefield::training
