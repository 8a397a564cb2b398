#pragma once

#include "common/model/onnx_operators.h"

/// Reductions over `axes` (an attribute, or from operator set 13 on an input); without axes over all dimensions, unless
/// noop_with_empty_axes. With keepdims (1) they stay as dimensions of size 1. Errors: a Refusal.
namespace gatefield::model::operators {

void reduce_l2(Call& call);    ///< root of the sum of squares
void reduce_max(Call& call);   ///< the largest
void reduce_mean(Call& call);  ///< mean
void reduce_min(Call& call);   ///< the smallest
void reduce_prod(Call& call);  ///< product
void reduce_sum(Call& call);   ///< sum

}  // namespace gatefield::model::operators
