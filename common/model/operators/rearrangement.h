#pragma once

#include "common/model/onnx_operators.h"

/// Operators that put numbers in other places and compute nothing. Errors: a Refusal.
namespace gatefield::model::operators {

void transpose(Call& call);  ///< out[i[perm[0]], i[perm[1]] ...] = in[i]; without perm: dimensions in reverse
void concat(Call& call);     ///< inputs one after another along `axis`
void slice(Call& call);      ///< starts, ends, axes, steps as inputs; ends beyond the edge mean the edge
void split(Call& call);      ///< parts along `axis`, of sizes `split` (attribute or input) or equal
void expand(Call& call);     ///< spread to a shape ("Multidirectional Broadcasting")
void tile(Call& call);       ///< repeated along each dimension
void gather(Call& call);     ///< out[.., j.., ..] = in[.., index[j..], ..] along `axis`; negative ones from the end
void pad(Call& call);        ///< edges of a constant (mode "constant" only), before and after each dimension

}  // namespace gatefield::model::operators
