#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "common/base/result.h"
#include "common/scene/sensor_noise.h"
#include "server/training/data/dataset.h"
#include "server/training/data/depth_frames.h"

/// Training images of gates that were never there: rendered into a user's own frames without a gate.
namespace gatefield::training {

/// Frames as every data set has them (dataset_camera()), and the same with their holes filled.
struct Backgrounds {
  std::vector<std::vector<float>> measured_m;
  std::vector<std::vector<float>> filled_m;
};

/// Errors: images that can't be read.   Thread-safe: yes.
Result<Backgrounds> load_backgrounds(const DepthFrames& frames);

/// Sample `index` of the set named by `seed`: one of the frames, gates and their stands drawn as in simulation. A gate
/// shows where it is nearer than what was measured there (in a hole: than what is far beside it). Noise is drawn over
/// the filled frame with gates and over the same without, by the same numbers: where the two differ, and on gates, the
/// first is what the sensor would have given, holes along the gates' edges and shadows included; everywhere else it is
/// what it gave. Labels are judged by the image without noise. Until a gate is in view another scene is drawn, but for
/// a fifth of the samples, which keep their frame as it was recorded.
/// Thread-safe: yes.   Real-time safe: no.
Sample compose(const Backgrounds& backgrounds, const scene::SensorNoise& noise, std::uint64_t seed, std::uint64_t index,
               double round_part = 0.0);

struct BackgroundOptions {
  std::uint64_t seed = 1;
  std::uint64_t count = 0;
  int threads = 1;
  double round_part = 0.0;
  scene::SensorNoise noise;
};

/// Fills a data set of kind kRecording: noise is in it, nobody knows the truth behind it. Continued like
/// generate_dataset()'s. Errors: as fill_dataset().
Status generate_on_backgrounds(const std::filesystem::path& file, const Backgrounds& backgrounds,
                               const BackgroundOptions& options,
                               const std::function<bool(const Progress&)>& progress = {});

}  // namespace gatefield::training
