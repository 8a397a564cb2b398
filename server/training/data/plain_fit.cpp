#include "server/training/data/plain_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/random.h"
#include "common/base/statistics.h"
#include "server/training/data/cloud_fit.h"
#include "server/training/data/surface_estimate.h"

namespace gatefield::training {
namespace {

constexpr double kEnoughJumps = 50.0;
constexpr std::size_t kEnoughLengths = 200, kEnoughGains = 8, kEnoughHoles = 50;
constexpr float kReflectance = 0.55f;  ///< of surfaces that nobody knows
constexpr std::uint64_t kDrawnSeed = 1;

struct Logistic {
  double step_px = 0.0, slope_px = 0.0;
  double jumps = 0.0;
};

/// Most likely logistic curve through how often jumps have holes.
Logistic fit_edges_to(const FrameStatistics& s) {
  Logistic best;
  double most = -std::numeric_limits<double>::infinity();
  for (double step_px = 0.5; step_px <= 8.0; step_px += 0.05)
    for (double slope_px = 0.1; slope_px <= 3.0; slope_px += 0.05) {
      double likelihood = 0.0;
      for (std::size_t bin = 0; bin < kJumpBins; ++bin) {
        const double middle_px = 0.5 * (kJumps_px[bin] + kJumps_px[bin + 1]);
        const double p = std::clamp(1.0 / (1.0 + std::exp((step_px - middle_px) / slope_px)), 1e-6, 1.0 - 1e-6);
        likelihood += s.jump_holes[bin] * std::log(p) + (s.jump_n[bin] - s.jump_holes[bin]) * std::log(1.0 - p);
      }
      if (likelihood <= most) continue;
      most = likelihood;
      best.step_px = step_px;
      best.slope_px = slope_px;
    }
  for (const double n : s.jump_n) best.jumps += n;
  return best;
}

/// Where a uniform distribution would begin and end that has these values between its first and last tenth.
std::pair<double, double> uniform_through(const std::vector<double>& values) {
  const double low = quantile(values, 0.1), high = quantile(values, 0.9);
  return {std::max(0.0, low - 0.125 * (high - low)), high + 0.125 * (high - low)};
}

/// Collects what is found, field by field.
class Parameters {
 public:
  explicit Parameters(scene::ActiveStereoNoise* noise) : noise_(noise) {}

  void found(const std::string& field, double value, const std::string& says) {
    for (const scene::ActiveStereoField& known : scene::active_stereo_fields())
      if (field == known.name) {
        noise_->*known.value = std::clamp(value, known.low, known.high);
        list_.push_back({field, noise_->*known.value, true, says});
      }
  }
  void kept(const std::string& field, const std::string& why) {
    list_.push_back({field, 0.0, false, "default: " + why});
  }

  /// In the struct's order; fields that nobody spoke of keep their default, too.
  std::vector<FittedParameter> in_order() const {
    std::vector<FittedParameter> out;
    for (const scene::ActiveStereoField& known : scene::active_stereo_fields()) {
      const auto at = std::ranges::find_if(list_, [&](const FittedParameter& p) { return p.field == known.name; });
      FittedParameter parameter =
          at != list_.end() ? *at : FittedParameter{known.name, 0.0, false, "default: single frames don't tell it"};
      parameter.value = noise_->*known.value;
      out.push_back(std::move(parameter));
    }
    return out;
  }

 private:
  scene::ActiveStereoNoise* noise_;
  std::vector<FittedParameter> list_;
};

void fit_lengths(const char* low_field, const char* high_field, const char* what, const std::vector<double>& lengths_px,
                 Parameters* parameters) {
  if (lengths_px.size() < kEnoughLengths) {
    for (const char* field : {low_field, high_field})
      parameters->kept(field, fmt::format("only {} holes {}", lengths_px.size(), what));
    return;
  }
  const auto [low, high] = uniform_through(lengths_px);
  const std::string says = fmt::format("fitted to {} holes {}", lengths_px.size(), what);
  parameters->found(low_field, low, says);
  parameters->found(high_field, high, says);
}

/// The noise over what the frames most likely show.
FrameStatistics draw_and_measure(const SensorGeometry& geometry, const scene::SensorNoise& noise,
                                 const std::vector<std::vector<float>>& frames) {
  CameraModel wide = geometry.camera;  // the recorded frames were not cut to the range either
  wide.min_depth_m = 0.05;
  wide.max_depth_m = 100.0;
  std::vector<std::vector<float>> drawn;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    scene::DepthImage clean{wide.width_px, wide.height_px, estimate_surfaces(geometry, frames[i])}, noisy;
    const scene::SurfaceImage surface{surface_cosines(geometry, clean.depth_m),
                                      std::vector<float>(clean.depth_m.size(), kReflectance)};
    Random random(kDrawnSeed, i);
    scene::apply_noise(noise, wide, clean, surface, &random, &noisy);
    drawn.push_back(std::move(noisy.depth_m));
  }
  return measure_frames(geometry, drawn);
}

}  // namespace

Result<PlainFit> fit_plain(const DepthFrames& frames, const PlainFitOptions& options) {
  if (frames.images.size() < 3)
    return Error{"folder " + frames.folder.string() + " has " + std::to_string(frames.images.size()) +
                     " frames, expected at least 3 (some hundred of several places are good)",
                 ErrorCode::kInvalid};
  std::vector<std::vector<float>> images;
  for (std::size_t i = 0; i < frames.images.size(); ++i) {
    auto image = read_frame(frames, i);
    if (!image) return image.failure();
    images.push_back(std::move(image).value());
  }
  SensorGeometry geometry{frames.camera.model, frames.camera.model.fx_px * options.decimation, options.baseline_m};
  PlainFit fit;
  fit.recorded = measure_frames(geometry, images);
  const FrameStatistics& s = fit.recorded;
  scene::ActiveStereoNoise& noise = fit.noise.active_stereo.emplace();
  Parameters parameters(&noise);
  parameters.found("focal_px", geometry.focal_px, fmt::format("as told: decimated {:g} times", options.decimation));
  parameters.found("baseline_m", options.baseline_m, "as told: depth does not tell it");

  double gain_square = 1.0;
  if (s.gain.size() >= kEnoughGains) {
    // 0.8 of the distribution lies between its tenths; even in the logarithm.
    const double half = 0.5 * std::log(quantile(s.gain, 0.9) / quantile(s.gain, 0.1)) / 0.8;
    const std::string says = fmt::format("fitted to {} frames; includes what chance does to each", s.gain.size());
    parameters.found("gain_min", std::exp(-half), says);
    parameters.found("gain_max", std::exp(half), says);
    if (half > 1e-3) gain_square = (std::exp(2.0 * half) - std::exp(-2.0 * half)) / (4.0 * half);
  } else {
    for (const char* field : {"gain_min", "gain_max"})
      parameters.kept(field, fmt::format("only {} frames have enough flat windows", s.gain.size()));
    const double span = std::log(noise.gain_max / noise.gain_min);
    gain_square = (noise.gain_max * noise.gain_max - noise.gain_min * noise.gain_min) / (2.0 * span);
  }
  const double step_px = find_step(geometry, images);
  if (step_px > 0.0) {
    parameters.found("step_px", step_px,
                     fmt::format("fitted: depths are {:.5g} m / k, k whole",
                                 static_cast<double>(geometry.focal_baseline()) / step_px));
  } else {
    parameters.kept("step_px", "no step is seen: the frames were averaged, or their depths are coarser");
  }
  const auto clouds = fit_clouds(geometry, s.flat, gain_square, step_px);
  if (!clouds) return clouds.failure().within(frames.folder.string() + ": ");
  noise.clouds = clouds->clouds;
  const std::string of_clouds =
      fmt::format("fitted to {} flat windows, moments within {:.0f} %", clouds->windows, 100.0 * clouds->misfit);
  parameters.found("small_radius_px", clouds->small_radius_px, of_clouds + "; one of 2.5, 3.5, 4.5, 6");
  parameters.found("large_radius_px", clouds->large_radius_px, of_clouds + "; one of 8, 10, 13, 17");
  parameters.found("white_px", clouds->white_px, of_clouds);

  const Logistic edges = fit_edges_to(s);
  if (edges.jumps >= kEnoughJumps * static_cast<double>(kJumpBins)) {
    parameters.found("edge_step_px", edges.step_px, fmt::format("fitted to {:.0f} jumps", edges.jumps));
    parameters.found("edge_slope_px", edges.slope_px, fmt::format("fitted to {:.0f} jumps", edges.jumps));
  } else {
    for (const char* field : {"edge_step_px", "edge_slope_px"})
      parameters.kept(field, fmt::format("only {:.0f} jumps", edges.jumps));
  }
  fit_lengths("edge_width_min_px", "edge_width_max_px", "along columns", s.above_px, &parameters);
  fit_lengths("right_width_min_px", "right_width_max_px", "right of near things", s.gap_px, &parameters);
  if (s.shadow_px.size() >= kEnoughLengths) {
    const double middle_px = quantile(s.shadow_px, 0.5);
    std::vector<double> away_px;
    for (const double x : s.shadow_px) away_px.push_back(std::abs(x - middle_px));
    const std::string says = fmt::format("fitted to {} shadows", s.shadow_px.size());
    parameters.found("shadow_extra_px", middle_px, says);
    parameters.found("shadow_sigma_px", 1.4826 * quantile(away_px, 0.5), says);
  } else {
    for (const char* field : {"shadow_extra_px", "shadow_sigma_px"})
      parameters.kept(field, fmt::format("only {} shadows", s.shadow_px.size()));
  }
  if (std::isfinite(s.band_px)) {
    parameters.found("band_px", s.band_px, "fitted to the first measured pixel of each row");
    parameters.found("band_sigma_px", s.band_sigma_px, "fitted to the first measured pixel of each row");
  }
  if (std::isfinite(s.band_rows_px)) parameters.found("ragged_px", s.band_rows_px, "rows over which the band is alike");
  const double darkness = std::pow(1.0 - static_cast<double>(kReflectance), 3);
  const double weight = std::max(darkness, s.slant);
  parameters.found(
      "patch_loss", std::min(1.0, s.lost_inside / weight),
      fmt::format("{:.2f} % are lost inside of surfaces; taken for surfaces that reflect 55 %", 100.0 * s.lost_inside));
  if (s.inside_area_px2.size() >= kEnoughHoles) {
    const std::string says = fmt::format("fitted to {} holes inside of surfaces", s.inside_area_px2.size());
    parameters.found("patch_area_min_px2", quantile(s.inside_area_px2, 0.02), says);
    parameters.found("patch_area_max_px2", quantile(s.inside_area_px2, 0.98), says);
  }
  parameters.found("speckle_probability", s.islands, "pixels unlike all their neighbours");
  if (s.rows_lost > 0.0) {
    parameters.found("row_loss_rate", s.rows_lost * geometry.camera.height_px, "rows without any depth");
    parameters.found("row_loss_height_px", 1.0 / geometry.scale_px(), "taken as single rows");
  } else {
    parameters.kept("row_loss_rate", "no row was lost in these frames");
  }
  parameters.kept("fatten_px", "not seen without the truth");
  for (const char* field : {"smooth_window_px", "smooth_sigma_px", "smooth_below_px"})
    parameters.kept(field, "the matcher's, not told apart from the scene");
  for (const char* field : {"depth_scale_min", "depth_scale_max"}) parameters.kept(field, "not seen without the truth");
  for (const char* field : {"readout_s", "turn_rad_s"}) parameters.kept(field, "not seen in single frames");
  parameters.kept("render_to_m", fmt::format("{:.1f} % of the pixels lie beyond the range", 100.0 * s.beyond));
  if (const Status good = scene::validate(fit.noise); !good) return good.failure();
  fit.parameters = parameters.in_order();
  fit.drawn = draw_and_measure(geometry, fit.noise, images);
  return fit;
}

std::string to_text(const PlainFit& fit) {
  std::string out = fmt::format("{} frames\n", fit.recorded.frames);
  for (const FittedParameter& p : fit.parameters) out += fmt::format("{:<20} {:9.5g}  {}\n", p.field, p.value, p.says);
  out += "clouds: distance m, sigma of the small ones, of the large ones, px\n";
  for (const auto& cloud : fit.noise.active_stereo->clouds)
    out += fmt::format("{:>20.2f} {:9.4f} {:9.4f}\n", cloud.at_m, cloud.small_px, cloud.large_px);
  return out;
}

std::string to_markdown(const PlainFit& fit) {
  const FrameStatistics &a = fit.recorded, &b = fit.drawn;
  std::string out = fmt::format(
      "# Recorded frames and drawn ones\n\n{} frames. Drawn: the fitted noise over the surfaces that the same frames "
      "most likely show; errors wider than 24 px are in these surfaces already, so drawn figures count them twice.\n\n"
      "## Errors in flat windows\n\nSigma of the disparity after a plane was taken off, px of the sensor; in brackets "
      "that of differences of pixels that far apart. Mean of the lower three quarters of the windows.\n\n"
      "| distance, m | frames | windows |",
      a.frames);
  for (const double side_px : kWindows_px) out += fmt::format(" {:g} px |", side_px);
  for (const double lag_px : kLags_px) out += fmt::format(" ({:g} px) |", lag_px);
  out += "\n| --- | --- | --- |";
  for (std::size_t k = 0; k < kMoments; ++k) out += " --- |";
  out += "\n";
  for (std::size_t bin = 0; bin < kBins; ++bin)
    for (const auto& [name, s] : {std::pair{"recorded", &a}, {"drawn", &b}}) {
      const std::string to = bin + 1 < kBins ? fmt::format("to {:g}", kStatisticsFrom_m[bin + 1]) : "and more";
      out += fmt::format("| {:g} {} | {} | {} |", kStatisticsFrom_m[bin], to, name, s->flat[bin].windows);
      for (const double px2 : s->flat[bin].px2)
        out += std::isfinite(px2) ? fmt::format(" {:.3f} |", std::sqrt(px2)) : " - |";
      out += "\n";
    }
  out += "\n## What is lost\n\n| | recorded | drawn |\n| --- | --- | --- |\n";
  const auto line = [&](const char* what, double recorded, double drawn, const char* unit) {
    out += fmt::format("| {} | {:.2f}{} | {:.2f}{} |\n", what, recorded, unit, drawn, unit);
  };
  line("without depth", 100.0 * a.lost, 100.0 * b.lost, " %");
  line("of these in the left band", 100.0 * a.lost_left, 100.0 * b.lost_left, " %");
  line("inside of surfaces", 100.0 * a.lost_inside, 100.0 * b.lost_inside, " %");
  line("of the holes' area outside the band: in holes over 20 px (160 wide)", 100.0 * a.lost_large,
       100.0 * b.lost_large, " %");
  line("in single pixels", 100.0 * a.lost_single, 100.0 * b.lost_single, " %");
  line("beyond the camera's range", 100.0 * a.beyond, 100.0 * b.beyond, " %");
  line("islands of one pixel", 100.0 * a.islands, 100.0 * b.islands, " %");
  line("left band beyond the disparity, median", a.band_px, b.band_px, " px");
  line("spread of its edge", a.band_sigma_px, b.band_sigma_px, " px");
  line("rows over which it is alike", a.band_rows_px, b.band_rows_px, " px");
  line("gap right of near things, median", quantile(a.gap_px, 0.5), quantile(b.gap_px, 0.5), " px");
  line("hole above and below, median", quantile(a.above_px, 0.5), quantile(b.above_px, 0.5), " px");
  line("shadow beyond the jump, median", quantile(a.shadow_px, 0.5), quantile(b.shadow_px, 0.5), " px");
  for (std::size_t bin = 0; bin < kJumpBins; ++bin) {
    const auto part = [&](const FrameStatistics& s) {
      return s.jump_n[bin] > 0 ? 100.0 * s.jump_holes[bin] / s.jump_n[bin] : 0.0;
    };
    line(fmt::format("hole inside a jump of {:g} to {:g} px", kJumps_px[bin], kJumps_px[bin + 1]).c_str(), part(a),
         part(b), " %");
  }
  return out;
}

}  // namespace gatefield::training
