#pragma once

#include "common/model/onnx_operators.h"

/// Operators whose every element depends on the elements in the same place only. Those of several inputs spread them to
/// a common shape ("Multidirectional Broadcasting"); the result is of integers when all inputs are.
/// Errors: a Refusal.
namespace gatefield::model::operators {

// One input x.
void abs(Call& call);           ///< |x|
void cast(Call& call);          ///< to float, int32, int64 (both truncate) or bool; anything else is refused
void ceil(Call& call);          ///< least integer >= x
void clip(Call& call);          ///< min(max(x, low), high); bounds that were left out are infinite
void cos(Call& call);           ///< cos x
void elu(Call& call);           ///< x, below 0: alpha (e^x - 1)
void erf(Call& call);           ///< Gauss's error function
void exp(Call& call);           ///< e^x
void floor(Call& call);         ///< greatest integer <= x
void hard_sigmoid(Call& call);  ///< alpha x + beta within 0 to 1
void hard_swish(Call& call);    ///< x (x / 6 + 1/2 within 0 to 1)
void identity(Call& call);      ///< x
void leaky_relu(Call& call);    ///< x, below 0: alpha x
void log(Call& call);           ///< natural logarithm
void neg(Call& call);           ///< -x
void reciprocal(Call& call);    ///< 1 / x
void relu(Call& call);          ///< max(x, 0)
void sigmoid(Call& call);       ///< 1 / (1 + e^-x)
void sin(Call& call);           ///< sin x
void softplus(Call& call);      ///< ln(1 + e^x)
void sqrt(Call& call);          ///< square root
void tanh(Call& call);          ///< hyperbolic tangent

// Several inputs a, b ...
void add(Call& call);    ///< a + b
void div(Call& call);    ///< a / b; integers towards 0, by zero refused
void equal(Call& call);  ///< a == b: 1, else 0
void max(Call& call);    ///< the largest of all inputs
void min(Call& call);    ///< the smallest of all inputs
void mul(Call& call);    ///< a b
void pow(Call& call);    ///< a to the power of b
void prelu(Call& call);  ///< a, below 0: b a
void sub(Call& call);    ///< a - b
void where(Call& call);  ///< b where a isn't 0, else c

}  // namespace gatefield::model::operators
