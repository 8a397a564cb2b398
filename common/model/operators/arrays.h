#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/model/onnx_operators.h"

/// What the families of operators share: arithmetic on shapes, and loops over arrays. Arrays are row-major; a stride is
/// the distance of neighbours along a dimension, in elements. Sizes come from the file: nothing here overflows.
/// Errors: a Refusal. Thread-safe: yes.   Real-time safe: no.
namespace gatefield::model::operators {

using Shape = std::vector<std::int64_t>;

/// Numbers that stand for 'to the end' saturate here, far above every budget.
inline constexpr std::int64_t kFar = std::int64_t{1} << 40;

/// Throws a Refusal with the sentence `otherwise` unless `good`.
void expect(bool good, const std::string& otherwise);

/// A signed index as the containers want it. @pre index >= 0
inline std::size_t at(std::int64_t index) { return static_cast<std::size_t>(index); }

/// Product of shape[from, to); at most kFar.
std::int64_t product(const Shape& shape, std::size_t from, std::size_t to);
inline std::int64_t product(const Shape& shape) { return product(shape, 0, shape.size()); }

/// Truncated, within -kFar to kFar; refuses NaN.
std::int64_t to_integer(double value);
/// The entries of a list of sizes or indices; refuses more than 64.
std::vector<std::int64_t> integers_of(const Array& array);

/// The dimension that `axis` names, -1 being the last one; refuses what `rank` dimensions don't have.
std::size_t axis_of(std::int64_t axis, std::size_t rank);
/// Axes: an attribute up to operator set 12, an input after it (torch writes either for some operators).
std::vector<std::int64_t> axes_of(Call& call);

Shape strides_of(const Shape& shape);

/// The shape that both spread to (ONNX, "Multidirectional Broadcasting"); refuses shapes that don't.
Shape broadcast(const Shape& a, const Shape& b);
/// Strides that read an array of `shape` as if it had been spread to `to`. @pre it spreads to it
Shape spread_strides(const Shape& shape, const Shape& to);

/// Calls visit(n, offset of every operand) for each element n of `shape` in order.
/// @param strides  [operand][dimension]
/// @param offset   of each operand's first element
template <std::size_t kOperands, typename Visit>
void walk(const Shape& shape, const std::array<Shape, kOperands>& strides, std::array<std::int64_t, kOperands> offset,
          Visit&& visit) {
  const std::int64_t count = product(shape);
  Shape index(shape.size(), 0);
  for (std::int64_t n = 0; n < count; ++n) {
    visit(n, offset);
    for (std::size_t d = shape.size(); d-- > 0;) {
      for (std::size_t k = 0; k < kOperands; ++k) offset[k] += strides[k][d];
      if (++index[d] < shape[d]) break;
      for (std::size_t k = 0; k < kOperands; ++k) offset[k] -= strides[k][d] * shape[d];
      index[d] = 0;
    }
  }
}

/// A view copied: out[i...] = in[offset + sum strides[d] i_d].
void copy_view(const Array& in, Array* out, const Shape& view, const Shape& strides, std::int64_t offset = 0);
/// The call's result: the numbers of `in` under another shape; refuses one of another size.
void copy_as(Call& call, const Array& in, const Shape& shape);

}  // namespace gatefield::model::operators
