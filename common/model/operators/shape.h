#pragma once

#include "common/model/onnx_operators.h"

/// Operators that ask for a shape, or give the same numbers another one. Errors: a Refusal.
namespace gatefield::model::operators {

void shape(Call& call);              ///< the sizes of the input, as integers
void constant_of_shape(Call& call);  ///< an array of the shape that the input lists, filled with `value` (0)
void reshape(Call& call);            ///< to the second input: -1 is what is left, 0 (without allowzero) as it was
void flatten(Call& call);            ///< two dimensions: those before `axis` (1), those from it on
void unsqueeze(Call& call);          ///< dimensions of size 1 more, at `axes` of the result
void squeeze(Call& call);            ///< without the dimensions `axes` of size 1; without axes: all of them

}  // namespace gatefield::model::operators
