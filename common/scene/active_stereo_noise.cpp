#include "common/scene/active_stereo_noise.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>
#include <tuple>

#include "common/base/random.h"
#include "common/scene/active_stereo_losses.h"
#include "common/scene/noise_planes.h"

namespace gatefield::scene {
namespace {

constexpr const char* kMeasured = "measured on 200 frames of one D435-class camera in one room";
constexpr const char* kSheet = "the D435's data sheet";
constexpr const char* kChosen = "chosen, not measured";

using Noise = ActiveStereoNoise;
constexpr ActiveStereoField kFields[] = {
    {"focal_px", &Noise::focal_px, 10, 1e4, "focal length of the sensor's own images", kMeasured},
    {"baseline_m", &Noise::baseline_m, 0.005, 1, "between the two imagers", kSheet},
    {"small_radius_px", &Noise::small_radius_px, 0, 100, "of the small clouds", kMeasured},
    {"large_radius_px", &Noise::large_radius_px, 0, 100, "of the large clouds", kMeasured},
    {"gain_min", &Noise::gain_min, 0, 10, "clouds of an image, times: drawn from here ...", kMeasured},
    {"gain_max", &Noise::gain_max, 0, 10, "... to here, evenly in its logarithm", kMeasured},
    {"white_px", &Noise::white_px, 0, 10, "sigma of each pixel's own error", kMeasured},
    {"step_px", &Noise::step_px, 0, 2, "disparities are multiples of it; 0: none", kMeasured},
    {"smooth_window_px", &Noise::smooth_window_px, 1, 101, "window of the matcher", kMeasured},
    {"smooth_sigma_px", &Noise::smooth_sigma_px, 0, 50, "blur of the disparity there", kMeasured},
    {"smooth_below_px", &Noise::smooth_below_px, 0, 20, "where it spans less than this", kMeasured},
    {"edge_step_px", &Noise::edge_step_px, 0, 100, "jump that has a hole half of the time", kMeasured},
    {"edge_slope_px", &Noise::edge_slope_px, 0.01, 100, "how fast that grows with the jump", kMeasured},
    {"edge_width_min_px", &Noise::edge_width_min_px, 0, 50, "width of such holes: drawn from here ...", kMeasured},
    {"edge_width_max_px", &Noise::edge_width_max_px, 0, 50, "... to here", kMeasured},
    {"right_width_min_px", &Noise::right_width_min_px, 0, 50, "the same right of near things: from ...", kMeasured},
    {"right_width_max_px", &Noise::right_width_max_px, 0, 50, "... to", kMeasured},
    {"fatten_px", &Noise::fatten_px, 0, 20, "near surfaces grow over far ones by this",
     "not seen without the truth; 0"},
    {"shadow_extra_px", &Noise::shadow_extra_px, -20, 50, "shadow of the second imager, longer by", kMeasured},
    {"shadow_sigma_px", &Noise::shadow_sigma_px, 0, 20, "raggedness of its end", kMeasured},
    {"band_px", &Noise::band_px, -1000, 100, "left band without depth, beyond the disparity; -1000: none", kMeasured},
    {"band_sigma_px", &Noise::band_sigma_px, 0, 50, "raggedness of its edge", kMeasured},
    {"ragged_px", &Noise::ragged_px, 0, 50, "over which ragged edges are alike", kMeasured},
    {"patch_loss", &Noise::patch_loss, 0, 1, "part that is lost where incidence or darkness is full",
     "measured: 0.75 % of all, taken as of surfaces that reflect 55 %"},
    {"patch_area_min_px2", &Noise::patch_area_min_px2, 0.1, 1e5, "of such patches: from ...", kMeasured},
    {"patch_area_max_px2", &Noise::patch_area_max_px2, 0.1, 1e5, "... to, evenly in its logarithm", kMeasured},
    {"speckle_probability", &Noise::speckle_probability, 0, 1, "wrong match: any depth", kMeasured},
    {"depth_scale_min", &Noise::depth_scale_min, 0.5, 2, "depth of a sensor, times: from ...",
     "chosen; the data sheet promises 2 % at 2 m"},
    {"depth_scale_max", &Noise::depth_scale_max, 0.5, 2, "... to", "as depth_scale_min"},
    {"readout_s", &Noise::readout_s, 0, 0.1, "from the first row to the last; 0: global shutter", kSheet},
    {"turn_rad_s", &Noise::turn_rad_s, 0, 50, "at most, about each axis, while rows are taken", kChosen},
    {"row_loss_rate", &Noise::row_loss_rate, 0, 100, "strips of lost rows in an image, mean", kChosen},
    {"row_loss_height_px", &Noise::row_loss_height_px, 0, 1000, "highest such strip", kChosen},
    {"render_to_m", &Noise::render_to_m, 0.5, 60, "surfaces that the sensor sees though beyond its range",
     "measured: returns up to 65 m; 25 m is 0.8 px"},
};

float drawn_between(double low, double high, Random* random) {
  return static_cast<float>(low + (high - low) * random->uniform());
}

/// clean, each row at its own time while the camera turns by w_C.
void roll(const ActiveStereoNoise& noise, const CameraModel& camera, const DepthImage& clean, Random* random,
          std::vector<float>* z_m) {
  const double w_x = noise.turn_rad_s * random->uniform(-1.0, 1.0);
  const double w_y = noise.turn_rad_s * random->uniform(-1.0, 1.0);
  *z_m = clean.depth_m;
  if (noise.readout_s <= 0.0) return;
  for (int v = 0; v < clean.height_px; ++v) {
    const double late_s = noise.readout_s * ((v + 0.5) / clean.height_px - 0.5);
    const int from_v = v + static_cast<int>(std::lround(camera.fy_px * w_x * late_s));
    const int shift_u = static_cast<int>(std::lround(camera.fx_px * w_y * late_s));
    for (int u = 0; u < clean.width_px; ++u) {
      const int from_u = u + shift_u;
      const bool inside = from_v >= 0 && from_v < clean.height_px && from_u >= 0 && from_u < clean.width_px;
      (*z_m)[static_cast<std::size_t>(v) * clean.width_px + u] =
          inside ? clean.depth_m[static_cast<std::size_t>(from_v) * clean.width_px + from_u] : 0.0f;
    }
  }
}

/// Where disparities span little within the window they are blurred; others, and none (0), stay as they are.
void smooth(const ActiveStereoNoise& noise, double scale_px, int width, int height, std::vector<float>* d_px) {
  const int reach = std::max(0, static_cast<int>(std::lround(0.5 * (noise.smooth_window_px * scale_px - 1.0))));
  const double sigma_px = noise.smooth_sigma_px * scale_px;
  if (reach == 0 || sigma_px <= 0.0) return;
  std::vector<float> weights;
  for (int i = -reach; i <= reach; ++i)
    weights.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  static thread_local std::vector<float> low, high, sum, weight;
  const std::size_t pixels = d_px->size();
  for (auto* plane : {&low, &high, &sum, &weight}) plane->resize(pixels);
  constexpr float kNone = 1e9f;
  for (int v = 0; v < height; ++v) {
    const float* const row = d_px->data() + static_cast<std::size_t>(v) * width;
    for (int u = 0; u < width; ++u) {
      float least = kNone, most = 0.0f, total = 0.0f, counted = 0.0f;
      for (int k = std::max(-reach, -u); k <= std::min(reach, width - 1 - u); ++k) {
        const float d = row[u + k];
        if (d <= 0.0f) continue;
        const float w = weights[static_cast<std::size_t>(k + reach)];
        least = std::min(least, d);
        most = std::max(most, d);
        total += w * d;
        counted += w;
      }
      const std::size_t i = static_cast<std::size_t>(v) * width + u;
      low[i] = least;
      high[i] = most;
      sum[i] = total;
      weight[i] = counted;
    }
  }
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * width + u;
      if ((*d_px)[i] <= 0.0f) continue;
      float least = kNone, most = 0.0f, total = 0.0f, counted = 0.0f;
      for (int k = std::max(-reach, -v); k <= std::min(reach, height - 1 - v); ++k) {
        const std::size_t at = i + static_cast<std::ptrdiff_t>(k) * width;
        const float w = weights[static_cast<std::size_t>(k + reach)];
        least = std::min(least, low[at]);
        most = std::max(most, high[at]);
        total += w * sum[at];
        counted += w * weight[at];
      }
      if (most - least < static_cast<float>(noise.smooth_below_px)) (*d_px)[i] = total / counted;
    }
  }
}

}  // namespace

std::span<const ActiveStereoField> active_stereo_fields() noexcept { return kFields; }

Status validate(const ActiveStereoNoise& noise) {
  const auto wrong = [](const std::string& field, double value, const std::string& expected) {
    return Error::invalid("noise.active_stereo." + field, std::to_string(value), expected);
  };
  for (const ActiveStereoField& field : kFields) {
    const double value = noise.*field.value;
    if (!(value >= field.low && value <= field.high))
      return wrong(field.name, value, std::to_string(field.low) + " to " + std::to_string(field.high));
  }
  for (const auto& [name, low, high] :
       {std::tuple("gain_max", noise.gain_min, noise.gain_max),
        std::tuple("edge_width_max_px", noise.edge_width_min_px, noise.edge_width_max_px),
        std::tuple("right_width_max_px", noise.right_width_min_px, noise.right_width_max_px),
        std::tuple("patch_area_max_px2", noise.patch_area_min_px2, noise.patch_area_max_px2),
        std::tuple("depth_scale_max", noise.depth_scale_min, noise.depth_scale_max)}) {
    if (high < low) return wrong(name, high, "at least " + std::to_string(low) + ", the least that is drawn");
  }
  if (noise.clouds.empty()) return wrong("cloud", 0.0, "sigmas at one distance at least");
  for (std::size_t i = 0; i < noise.clouds.size(); ++i) {
    const auto& cloud = noise.clouds[i];
    const std::string name = "cloud[" + std::to_string(i) + "].";
    if (!(cloud.at_m >= 0.0 && cloud.at_m <= 100.0)) return wrong(name + "at_m", cloud.at_m, "0 to 100 m");
    if (i > 0 && !(cloud.at_m > noise.clouds[i - 1].at_m))
      return wrong(name + "at_m", cloud.at_m, "more than the one before");
    if (!(cloud.small_px >= 0.0 && cloud.small_px <= 10.0))
      return wrong(name + "small_px", cloud.small_px, "0 to 10 px");
    if (!(cloud.large_px >= 0.0 && cloud.large_px <= 10.0))
      return wrong(name + "large_px", cloud.large_px, "0 to 10 px");
  }
  return {};
}

ActiveStereoNoise::Cloud cloud_at(const ActiveStereoNoise& noise, double z_m) noexcept {
  const auto& clouds = noise.clouds;
  const auto above = std::find_if(clouds.begin(), clouds.end(), [&](const auto& cloud) { return cloud.at_m >= z_m; });
  if (above == clouds.begin()) return {z_m, above->small_px, above->large_px};
  if (above == clouds.end()) return {z_m, clouds.back().small_px, clouds.back().large_px};
  const auto& below = *std::prev(above);
  const double part = (z_m - below.at_m) / (above->at_m - below.at_m);
  return {z_m, below.small_px + part * (above->small_px - below.small_px),
          below.large_px + part * (above->large_px - below.large_px)};
}

void apply_active_stereo(const ActiveStereoNoise& noise, double scale, const CameraModel& camera,
                         const DepthImage& clean, const SurfaceImage& surface, std::array<std::uint32_t, 2> key,
                         DepthImage* noisy) {
  const int width = clean.width_px, height = clean.height_px;
  const std::size_t pixels = clean.depth_m.size();
  static thread_local std::vector<float> z_m, d_px, true_px, small, large;
  static thread_local ImageDraws draws;
  Random random((std::uint64_t{key[1]} << 32) | key[0], kImageDraws);
  const double log_gain = std::log(std::max(noise.gain_max, 1e-9)) - std::log(std::max(noise.gain_min, 1e-9));
  const auto gain = static_cast<float>(scale * noise.gain_min * std::exp(log_gain * random.uniform()));
  const float stretch =
      1.0f + static_cast<float>(scale) * (drawn_between(noise.depth_scale_min, noise.depth_scale_max, &random) - 1.0f);
  roll(noise, camera, clean, &random, &z_m);

  const double scale_px = camera.fx_px / noise.focal_px;
  const auto focal_baseline = static_cast<float>(noise.focal_px * noise.baseline_m);
  d_px.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) d_px[i] = z_m[i] > 0.0f ? focal_baseline / z_m[i] : 0.0f;
  draws.draw(noise, scale_px, width, height, key);
  fatten(noise, scale_px, draws, width, height, &d_px);
  true_px = d_px;
  smooth(noise, scale_px, width, height, &d_px);

  draw_field(key, kSmallClouds, width, height, noise.small_radius_px * scale_px, &small);
  draw_field(key, kLargeClouds, width, height, noise.large_radius_px * scale_px, &large);
  const auto white = static_cast<float>(noise.white_px);
  const auto step = static_cast<float>(noise.step_px);
  const auto nearest_m = static_cast<float>(camera.min_depth_m), farthest_m = static_cast<float>(camera.max_depth_m);
  noisy->width_px = width;
  noisy->height_px = height;
  noisy->depth_m.resize(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (d_px[i] <= 0.0f) {
      noisy->depth_m[i] = 0.0f;
      continue;
    }
    const ActiveStereoNoise::Cloud cloud = cloud_at(noise, static_cast<double>(focal_baseline / d_px[i]));
    float d = d_px[i] + gain * (static_cast<float>(cloud.small_px) * small[i] +
                                static_cast<float>(cloud.large_px) * large[i] + white * draws.white[i]);
    if (step > 0.0f) d = step * std::round(d / step);
    const float measured_m = d > 0.0f ? stretch * focal_baseline / d : 0.0f;
    noisy->depth_m[i] = measured_m >= nearest_m && measured_m <= farthest_m ? measured_m : 0.0f;
  }

  lose_edges(noise, scale_px, draws, width, height, true_px, noisy->depth_m);
  lose_hidden(noise, scale_px, draws, width, height, true_px, noisy->depth_m);
  lose_at_random(noise, scale, scale_px, camera, surface, draws, key, noisy);
}

}  // namespace gatefield::scene
