#pragma once

#include "common/model/onnx_operators.h"

/// Operators that shift and scale numbers by what a group of them has in common. Errors: a Refusal.
namespace gatefield::model::operators {

/// (x - mean[c]) / sqrt(variance[c] + epsilon) scale[c] + shift[c], all given per channel c; training mode is refused.
void batch_normalization(Call& call);
/// The same with mean and variance of each image and channel itself.
void instance_normalization(Call& call);
/// e^x / sum e^x along `axis`; up to operator set 12 over everything from the axis on.
void softmax(Call& call);

}  // namespace gatefield::model::operators
