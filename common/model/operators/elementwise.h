#pragma once

#include "common/model/onnx_operators.h"

/// Operators whose every element depends on the elements in the same place only. Those of several inputs spread them to
/// a common shape ("Multidirectional Broadcasting"); the result is of integers when all inputs are. Most are a formula
/// in the table of operators. Errors: a Refusal.
namespace gatefield::model::operators {

void each(Call& call);      ///< the table's unary formula of the only input
void both(Call& call);      ///< the table's binary formula of two inputs
void over_all(Call& call);  ///< the same, over all inputs one after the other

void cast(Call& call);          ///< to float, int32, int64 (both truncate) or bool; anything else is refused
void cast_like(Call& call);     ///< to what the second input is of
void clip(Call& call);          ///< min(max(x, low), high); bounds that were left out are infinite
void div(Call& call);           ///< a / b; integers towards 0, by zero refused
void elu(Call& call);           ///< x, below 0: alpha (e^x - 1)
void equal(Call& call);         ///< a == b: 1, else 0
void hard_sigmoid(Call& call);  ///< alpha x + beta within 0 to 1
void leaky_relu(Call& call);    ///< x, below 0: alpha x
void where(Call& call);         ///< b where a isn't 0, else c

}  // namespace gatefield::model::operators
