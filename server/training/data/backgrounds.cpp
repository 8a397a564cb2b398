#include "server/training/data/backgrounds.h"

#include <algorithm>
#include <string>
#include <utility>

#include "common/model/two_look.h"
#include "server/training/data/fill.h"
#include "server/training/data/scenes.h"
#include "server/training/data/surface_estimate.h"

namespace gatefield::training {
namespace {

constexpr double kEmpty = 0.2;  ///< samples that keep their frame as it was recorded
constexpr int kAttempts = 25;   ///< scenes until a gate is in view; small rooms hide most

std::vector<std::uint16_t> millimetres(const std::vector<float>& depth_m) {
  std::vector<std::uint16_t> mm(depth_m.size());
  std::ranges::transform(depth_m, mm.begin(), [](float z_m) {
    return static_cast<std::uint16_t>(std::min(z_m * 1000.0f + 0.5f, 65535.0f));
  });
  return mm;
}

/// Gates as the camera would see them before this background.
struct Composed {
  scene::DepthImage clean;
  scene::SurfaceImage surface;
  std::vector<std::uint8_t> gate;  ///< 1: the pixel shows a gate or its stand
  std::vector<GateLabel> labels;
  bool valid = false;
};

Composed render_before(const std::vector<float>& filled_m, double round_part, Random* random) {
  const CameraModel& camera = dataset_camera();
  const Scenario scenario = draw_scenario(camera, random, {.round_part = round_part, .alone = true});
  Composed out;
  scene::DepthCamera(scenario.world).render(camera, scenario.X_WC, &out.clean, &out.surface);
  out.gate.resize(filled_m.size());
  for (std::size_t i = 0; i < filled_m.size(); ++i) {
    const float gate_m = out.clean.depth_m[i];
    out.gate[i] = gate_m > 0.0f && (filled_m[i] <= 0.0f || gate_m < filled_m[i]) ? 1 : 0;
    if (out.gate[i] != 0) continue;
    out.clean.depth_m[i] = filled_m[i];
    out.surface.cos_incidence[i] = out.surface.reflectance[i] = 1.0f;  // what it loses is lost in the recording
  }
  const std::vector<std::uint16_t> clean_mm = millimetres(out.clean.depth_m);
  const Eigen::Isometry3d X_CW = scenario.X_WC.inverse();
  for (std::size_t g = 0; g < scenario.gates; ++g) {
    const Eigen::Isometry3d X_CG = X_CW * scenario.world.gates[g].X_WG;
    GateLabel label;
    label.p_CG = X_CG.translation().cast<float>();
    label.q_CG = Eigen::Quaterniond(X_CG.linear()).normalized().cast<float>();
    label.shape = scenario.world.gates[g].shape;
    label.visible_fraction = visible_fraction(camera, clean_mm, label.shape, label.X_CG());
    out.valid = out.valid || label.valid();
    out.labels.push_back(label);
  }
  return out;
}

}  // namespace

Result<Backgrounds> load_backgrounds(const DepthFrames& frames) {
  Backgrounds out;
  for (std::size_t i = 0; i < frames.images.size(); ++i) {
    auto image = read_frame(frames, i);
    if (!image) return image.failure();
    cut_to_range(frames.camera.model, &image.value());
    std::vector<float> resampled_m;
    model::resample_nearest(*image, frames.camera.model, dataset_camera(), &resampled_m);
    out.filled_m.push_back(fill_holes(resampled_m, kImageWidth_px));
    out.measured_m.push_back(std::move(resampled_m));
  }
  return out;
}

Sample compose(const Backgrounds& backgrounds, const scene::SensorNoise& noise, std::uint64_t seed, std::uint64_t index,
               double round_part) {
  Random random(seed, index);
  const std::size_t frame = random.below(static_cast<std::uint32_t>(backgrounds.measured_m.size()));
  const std::vector<float>& measured_m = backgrounds.measured_m[frame];
  const std::vector<float>& filled_m = backgrounds.filled_m[frame];
  Sample sample;
  sample.sequence = static_cast<std::uint32_t>(frame);
  sample.measured_mm = millimetres(measured_m);
  if (random.chance(kEmpty)) return sample;

  Composed composed;
  for (int attempt = 0; attempt < kAttempts && !composed.valid; ++attempt)
    composed = render_before(filled_m, round_part, &random);
  const scene::DepthImage alone{kImageWidth_px, kImageHeight_px, filled_m};
  const scene::SurfaceImage bright{std::vector<float>(filled_m.size(), 1.0f),
                                   std::vector<float>(filled_m.size(), 1.0f)};
  scene::DepthImage with_gates, without;
  Random same = random;
  scene::apply_noise(noise, dataset_camera(), composed.clean, composed.surface, &random, &with_gates);
  scene::apply_noise(noise, dataset_camera(), alone, bright, &same, &without);
  std::vector<float> out_m = measured_m;
  for (std::size_t i = 0; i < out_m.size(); ++i)
    if (composed.gate[i] != 0 || with_gates.depth_m[i] != without.depth_m[i]) out_m[i] = with_gates.depth_m[i];
  sample.measured_mm = millimetres(out_m);
  set_gates(std::move(composed.labels), &sample);
  return sample;
}

Status generate_on_backgrounds(const std::filesystem::path& file, const Backgrounds& backgrounds,
                               const BackgroundOptions& options, const std::function<bool(const Progress&)>& progress) {
  DatasetInfo info;
  info.kind = DatasetKind::kRecording;
  info.seed = options.seed;
  info.round_part = options.round_part;
  info.note = "gates rendered into " + std::to_string(backgrounds.measured_m.size()) +
              " frames by gatefield-train, scenes " + std::to_string(kScenesVersion);
  DatasetColumns columns;
  columns.sequence = true;
  const auto make = [&](std::uint64_t done, std::uint64_t job, std::vector<Sample>* samples) {
    if (done + job >= options.count) return;
    samples->push_back(compose(backgrounds, options.noise, options.seed, done + job, options.round_part));
  };
  return fill_dataset(file, {info, columns, options.count, 256, options.threads, make}, progress);
}

}  // namespace gatefield::training
