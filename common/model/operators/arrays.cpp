#include "common/model/operators/arrays.h"

#include <algorithm>
#include <cmath>

#include "common/model/onnx_file.h"

namespace gatefield::model::operators {

void expect(bool good, const std::string& otherwise) {
  if (!good) throw Refusal(otherwise);
}

std::int64_t product(const Shape& shape, std::size_t from, std::size_t to) {
  double count = 1.0;
  for (std::size_t i = from; i < to; ++i) count *= static_cast<double>(shape[i]);
  return count > static_cast<double>(kFar) ? kFar : static_cast<std::int64_t>(count);
}

std::int64_t to_integer(double value) {
  expect(!std::isnan(value), "a size or index is not a number");
  return static_cast<std::int64_t>(std::clamp(value, -static_cast<double>(kFar), static_cast<double>(kFar)));
}

std::vector<std::int64_t> integers_of(const Array& array) {
  expect(array.values.size() <= 64, "a list of sizes has " + std::to_string(array.values.size()) + " entries");
  std::vector<std::int64_t> list;
  for (const double value : array.values) list.push_back(to_integer(value));
  return list;
}

std::size_t axis_of(std::int64_t axis, std::size_t rank) {
  const auto n = static_cast<std::int64_t>(rank);
  expect(axis >= -n && axis < n,
         "axis is " + std::to_string(axis) + " for an input of " + std::to_string(rank) + " dimensions");
  return at(axis < 0 ? axis + n : axis);
}

std::vector<std::int64_t> axes_of(Call& call) {
  if (call.has(1)) return integers_of(call.input(1));
  return call.integers("axes", {});
}

Shape strides_of(const Shape& shape) {
  Shape strides(shape.size(), 1);
  for (std::size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return strides;
}

Shape broadcast(const Shape& a, const Shape& b) {
  Shape out(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < out.size(); ++i) {  // from the last dimension on
    const std::int64_t left = i < a.size() ? a[a.size() - 1 - i] : 1;
    const std::int64_t right = i < b.size() ? b[b.size() - 1 - i] : 1;
    expect(left == right || left == 1 || right == 1,
           "shapes " + shape_text(a) + " and " + shape_text(b) + " don't fit");
    out[out.size() - 1 - i] = left == 1 ? right : left;
  }
  return out;
}

Shape spread_strides(const Shape& shape, const Shape& to) {
  const Shape own = strides_of(shape);
  Shape strides(to.size(), 0);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] != 1) strides[to.size() - shape.size() + i] = own[i];
  }
  return strides;
}

void copy_view(const Array& in, Array* out, const Shape& view, const Shape& strides, std::int64_t offset) {
  walk<1>(view, {strides}, {offset},
          [&](std::int64_t n, const auto& from) { out->values[at(n)] = in.values[at(from[0])]; });
}

void copy_as(Call& call, const Array& in, const Shape& shape) {
  expect(product(shape) == static_cast<std::int64_t>(in.values.size()),
         "can't make shape " + shape_text(shape) + " of " + shape_text(in.shape));
  call.result(shape, in.integer).values = in.values;
}

}  // namespace gatefield::model::operators
