#pragma once

#include "common/model/onnx_operators.h"

/// Images in another size. Errors: a Refusal.
namespace gatefield::model::operators {

/// Along each dimension in turn, by `scales` (input 2) or to `sizes` (input 3): element o of the result lies at
///   asymmetric         x = o / scale
///   align_corners      x = o (before - 1) / (after - 1)
///   half_pixel         x = (o + 1/2) / scale - 1/2
///   pytorch_half_pixel the same, but 0 when the result has one element
/// of the input; mode "linear" takes (1 - w) in[floor x] + w in[floor x + 1] with w = x - floor x, mode "nearest" the
/// element that nearest_mode rounds x to. Places beyond an edge are the edge. The region of interest is not looked at.
void resize(Call& call);

}  // namespace gatefield::model::operators
