#pragma once

#include "common/model/onnx_operators.h"

/// Convolutions over two dimensions. Errors: a Refusal.
namespace gatefield::model::operators {

/// out[n, o, y, x] = bias[o] + sum over c, i, j of weight[o, c, i, j] in[n, c, row(y, i), column(x, j)], places in the
/// padding being 0 (operators/window.h says which place that is). With `group` g, output o sees the inputs of its group
/// only.
/// Input [batch, channels, rows, columns], weight [outputs, channels / g, kernel], bias [outputs] or none.
void conv(Call& call);

}  // namespace gatefield::model::operators
