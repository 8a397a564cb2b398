#include "server/training/data/noise_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "server/training/data/measured_frames.h"
#include "server/training/data/noise_disparity.h"
#include "server/training/data/noise_edges.h"
#include "server/training/data/noise_holes.h"
#include "server/training/data/noise_incidence.h"

namespace gatefield::training {
namespace {

/// Whether the recording has what a fit needs.
Status check(const Dataset& dataset, const NoiseFitOptions& options) {
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
  return {};
}

}  // namespace

Result<NoiseFit> fit_noise(const Dataset& dataset, const NoiseFitOptions& options,
                           const std::function<bool(double part)>& progress) {
  if (const Status good = check(dataset, options); !good) return good.failure();
  MeasuredFrames frames(dataset, options);
  int stage = 0;
  const auto go_on = [&] { return !progress || progress(++stage / 3.0); };
  NoiseFit fit;  // what is not found below keeps the noise's default
  scene::SensorNoise& noise = fit.noise;
  fit.frames = frames.count();
  noise.baseline_m = options.baseline_m;

  const Result<DisparityFit> disparity = fit_disparity(frames);
  if (!disparity) return disparity.failure();
  fit.bias_px = disparity->bias_px;
  noise.disparity_noise_px = disparity->noise_px;
  if (disparity->step_px >= 0.0) noise.disparity_step_px = disparity->step_px;
  if (disparity->speckle_seen()) noise.speckle_probability = disparity->wrong / disparity->could_be_wrong;
  if (!go_on()) return Error{"stopped"};

  const IncidenceFit incidence = fit_incidence(frames);
  if (incidence.seen) noise.incidence_loss = incidence.loss;
  if (!go_on()) return Error{"stopped"};

  const HoleFit holes = fit_holes(frames, noise.incidence_loss);
  if (holes.seen) {
    noise.hole_rate_per_image = holes.any() ? std::min(holes.holes.per_pixel * kImageSize_px, 100.0) : 0.0;
  }
  if (holes.any()) noise.hole_radius_px = holes.holes.radius_px;
  if (holes.nothing_else()) noise.reflectance_loss = 0.0;

  const EdgeFit edges =
      fit_edges(frames, *disparity, noise.incidence_loss, incidence.square_on, noise.speckle_probability);
  if (edges.bleed_seen()) noise.bleed_probability = std::clamp(edges.bleed / edges.bleed_expected, 0.0, 1.0);
  if (edges.shadow_seen()) {
    noise.shadow_probability = std::clamp(1.0 - edges.shadow_kept / edges.shadow_expected, 0.0, 1.0);
  }

  const auto put = [&](const char* field, double value, bool fitted, const std::string& says) {
    fit.parameters.push_back({field, value, fitted, says});
  };
  put("baseline_m", noise.baseline_m, false, "as given: depth does not tell it");
  put("disparity_noise_px", noise.disparity_noise_px, true,
      fmt::format("fitted to {:.0f} pixels inside surfaces; mean error {:+.4f} px", disparity->pixels, fit.bias_px));
  put("disparity_step_px", noise.disparity_step_px, disparity->step_px >= 0.0,
      disparity->step_px > 0.0    ? "fitted: disparities are multiples of it"
      : disparity->step_px == 0.0 ? "none found down to 0.001 px"
                                  : "default: too few pixels between 2.5 and 8 m");
  put("bleed_probability", noise.bleed_probability, edges.bleed_seen(),
      edges.bleed_seen() ? fmt::format("fitted to {:.0f} pixels at edges", edges.bleed_n)
                         : fmt::format("default: only {:.0f} pixels at edges can be told from noise", edges.bleed_n));
  put("shadow_probability", noise.shadow_probability, edges.shadow_seen(),
      edges.shadow_seen()
          ? fmt::format("fitted to {:.0f} pixels hidden from the second imager", edges.shadow_n)
          : fmt::format("default: only {:.0f} pixels are hidden from the second imager", edges.shadow_n));
  put("hole_rate_per_image", noise.hole_rate_per_image, holes.seen,
      holes.seen
          ? fmt::format("fitted: holes cover {:.2f} % of the image", 100.0 * (holes.any() ? holes.holes.covered : 0.0))
          : "default: too few pixels");
  put("hole_radius_px", noise.hole_radius_px, holes.any(),
      !holes.any()                                      ? "default: there are no holes to measure"
      : holes.holes.radius_px > 2.0 * kLargestWindow_px ? "fitted, but so large holes are hardly told apart"
                                                        : "fitted");
  put("speckle_probability", noise.speckle_probability, disparity->speckle_seen(),
      disparity->speckle_seen() ? fmt::format("fitted: {:.0f} of {:.0f} pixels inside are beyond 6 sigma",
                                              disparity->wrong, disparity->pixels)
                                : "default: noise covers the range");
  put("incidence_loss", noise.incidence_loss, incidence.seen,
      incidence.seen ? fmt::format("fitted to {:.0f} pixels at more than 57 deg", incidence.slanted_n)
                     : fmt::format("default: only {:.0f} pixels at more than 57 deg", incidence.slanted_n));
  put("reflectance_loss", noise.reflectance_loss, holes.nothing_else(),
      holes.nothing_else()
          ? "nothing is missing but by holes and incidence"
          : fmt::format("default: a recording does not hold reflectance ({:.1f} % are missing for other reasons)",
                        100.0 * holes.lost_otherwise));
  put("scale", noise.scale, false, "1 by definition");
  if (!go_on()) return Error{"stopped"};
  return fit;
}

std::string to_text(const NoiseFit& fit) {
  std::string out = fmt::format("{} frames\n", fit.frames);
  for (const FittedParameter& p : fit.parameters) out += fmt::format("{:<20} {:9.5g}  {}\n", p.field, p.value, p.says);
  return out;
}

}  // namespace gatefield::training
