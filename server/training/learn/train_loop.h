#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/base/result.h"
#include "server/training/learn/trainer.h"

namespace gatefield::training {

/// Set by the program's signal handler; every long stage looks at it and leaves its files whole.
inline std::atomic<bool> stop_requested{false};

struct TrainRun {
  std::filesystem::path dataset_file;
  std::filesystem::path folder;         ///< checkpoint.pt, log.csv
  std::filesystem::path bundle_folder;  ///< written at every checkpoint; empty = never
  std::string name = "two_look";        ///< of the bundle
  bool plain = false;
  std::uint64_t images = 1'500'000;  ///< image passes in all; the learning rate's cosine ends there
  int batch = 32;
  int crops_per_image = 2;
  double learning_rate = 2e-3;
  int torch_threads = 1;
  int data_threads = 1;
  double checkpoint_every_s = 300.0;
  bool allow_bf16 = true;
  std::uint64_t seed = 1;
};

/// Trains to the end of the plan, or until stop_requested; continues from checkpoint.pt when there is one. At each
/// checkpoint the bundle is exported from the running average of the weights. Prints a progress line (images, losses,
/// images/s, time left) and writes log.csv, one line per 100 steps.
/// @return true when the plan is complete, false when it was stopped before. Errors: data set, checkpoint, disk, loss
/// not finite.
Result<bool> train(const TrainRun& run);

}  // namespace gatefield::training
