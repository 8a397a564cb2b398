#pragma once

#include <torch/types.h>

#include "server/training/learn/batches.h"
#include "server/training/learn/model.h"

namespace gatefield::training {

/// What one optimiser step makes smaller, and its parts (docs/training.md has the formulas and why each is there):
///   field + normal / 2 + validity + depth / 5 + predicted error / 20, with a centre + 2 centre,
///   with two looks + first centre / 2 + 3 votes / 10 + 3 segmentation / 10.
/// Two looks: cuts the crops around where the first look sees the gate.
/// @return one number with its gradient's path. Thread-safe: no; libtorch's exceptions pass.
torch::Tensor losses(Model& model, const Design& design, bool bf16, const BatchOptions& batch_options, Batch* batch,
                     StepLosses* out);

}  // namespace gatefield::training
