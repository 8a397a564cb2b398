#pragma once

#include "common/model/onnx_operators.h"

/// Matrix products. Errors: a Refusal.
namespace gatefield::model::operators {

void gemm(Call& call);    ///< alpha A B + beta C; A, B transposed by transA, transB; C spread to the result
void matmul(Call& call);  ///< A B over the last two dimensions, of at least two; the others spread

}  // namespace gatefield::model::operators
