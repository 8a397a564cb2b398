#pragma once

#include "common/model/onnx_operators.h"

/// Pooling over windows of an image, or over all of it. Padding is not among the values. Errors: a Refusal.
namespace gatefield::model::operators {

void average_pool(Call& call);         ///< mean of each window; count_include_pad: padding counts as zeros
void max_pool(Call& call);             ///< largest of each window
void global_average_pool(Call& call);  ///< mean of each channel: [batch, channels, 1, 1 ...]
void global_max_pool(Call& call);      ///< largest of each channel

}  // namespace gatefield::model::operators
