#pragma once

#include <torch/optim/optimizer.h>

#include <cstdint>
#include <exception>
#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "server/training/learn/designs.h"
#include "server/training/learn/model.h"

/// A training run on disk: weights, their running average, the optimiser's state, the step and the design's name. Not
/// for use outside of this folder. Thread-safe: no.
namespace gatefield::training {

/// What a checkpoint is made of, and read into.
struct CheckpointParts {
  Model& live;
  Model& averaged;
  torch::optim::Optimizer& optimizer;
};

/// Replaces the file in one go. Errors: it can't be written.
Status save_checkpoint(const std::filesystem::path& file, const Design& design, std::uint64_t step,
                       const CheckpointParts& parts);
/// @return the step. Errors: missing or foreign file, another design.
Result<std::uint64_t> load_checkpoint(const std::filesystem::path& file, const Design& design,
                                      const CheckpointParts& parts);

/// The design that a checkpoint belongs to. Errors: missing or foreign file.
Result<Design> checkpoint_design(const std::filesystem::path& file);
/// The averaged networks of a checkpoint of that design. Errors: foreign file.
Result<Model> averaged_in(const std::filesystem::path& file, const Design& design);

/// What libtorch says, without the stack that follows.
std::string first_line(const std::exception& error);

}  // namespace gatefield::training
