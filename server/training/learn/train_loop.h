#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/training/learn/trainer.h"

namespace gatefield::training {

/// Set by the program's signal handler; every long stage looks at it and leaves its files whole.
inline std::atomic<bool> stop_requested{false};

struct TrainRun {
  struct Data {
    std::filesystem::path file;  ///< empty: simulation without end, every image rendered when it is needed
    double part = 1.0;           ///< of the images, relative to the sum over all
    double round_part = 0.0;     ///< of the rendered images' gates; a file has its own
  };
  std::vector<Data> data;
  std::filesystem::path folder;         ///< checkpoint.pt, log.csv
  std::filesystem::path bundle_folder;  ///< written at every checkpoint; empty = never
  std::string name = "race";            ///< of the bundle
  Design design = designs().front();
  std::filesystem::path start_from;  ///< checkpoint whose weights a fresh run begins with; empty = random weights
  bool freeze_decoders = false;      ///< second stage: the encoder learns to say the same of another sensor's images
  std::uint64_t images = 800'000;    ///< image passes in all; the learning rate's cosine ends there
  int batch = 16;
  int crops_per_image = 4;
  int points = 96;           ///< query points per crop, drawn afresh in every pass
  scene::SensorNoise noise;  ///< of simulated images
  double learning_rate = 2e-3;
  int torch_threads = 1;
  int data_threads = 1;
  double checkpoint_every_s = 300.0;
  bool allow_bf16 = true;
  std::uint64_t seed = 1;
};

/// A plain design looks once at each image; it takes batch * crops_per_image / 2 images a step, so that a step weighs
/// about as much.
int images_per_step(const TrainRun& run) noexcept;

/// Trains to the end of the plan, or until stop_requested; continues from checkpoint.pt when there is one. At each
/// checkpoint the bundle is exported from the running average of the weights. Prints a progress line (images, losses,
/// images/s, time left) and writes log.csv, one line per 100 steps.
/// @return true when the plan is complete, false when it was stopped before. Errors: data set, checkpoint, disk, loss
/// not finite.
Result<bool> train(const TrainRun& run);

}  // namespace gatefield::training
