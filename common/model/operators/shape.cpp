#include "common/model/operators/shape.h"

#include <algorithm>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {

void shape(Call& call) {
  const Shape& shape = call.input(0).shape;
  const auto rank = static_cast<std::int64_t>(shape.size());
  const auto bound = [&](const char* name, std::int64_t otherwise) {
    const std::int64_t x = call.integer(name, otherwise);
    return std::clamp(x < 0 ? x + rank : x, std::int64_t{0}, rank);
  };
  const std::int64_t first = bound("start", 0), last = std::max(first, bound("end", rank));
  Array& out = call.result({last - first}, true);
  std::copy(shape.begin() + first, shape.begin() + last, out.values.begin());
}

void constant_of_shape(Call& call) {
  const auto value = call.node.attributes.find("value");
  const Array* const given = value == call.node.attributes.end() ? nullptr : value->second.array.get();
  expect(given == nullptr || given->values.size() == 1, "fills with something else than one number");
  Array& out = call.result(integers_of(call.input(0)), given != nullptr && given->integer);
  std::fill(out.values.begin(), out.values.end(), given != nullptr ? given->values[0] : 0.0);
}

void reshape(Call& call) {
  const Array& in = call.input(0);
  Shape shape = integers_of(call.input(1));
  const bool zero_is_zero = call.integer("allowzero", 0) != 0;
  std::int64_t known = 1;
  int open = -1;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] == 0 && !zero_is_zero) {
      expect(i < in.shape.size(), "takes over a size that its input " + shape_text(in.shape) + " doesn't have");
      shape[i] = in.shape[i];
    }
    if (shape[i] == -1) {
      expect(open < 0, "leaves two sizes open");
      open = static_cast<int>(i);
    } else {
      expect(shape[i] >= 0 && shape[i] <= kFar, "has the size " + std::to_string(shape[i]));
      known = product({known, shape[i]});
    }
  }
  if (open >= 0) shape[at(open)] = known == 0 ? 0 : static_cast<std::int64_t>(in.values.size()) / known;
  copy_as(call, in, shape);
}

void flatten(Call& call) {
  const Array& in = call.input(0);
  const auto rank = static_cast<std::int64_t>(in.shape.size());
  const std::int64_t axis = call.integer("axis", 1);
  expect(axis >= -rank && axis <= rank, "axis is " + std::to_string(axis) + " for " + shape_text(in.shape));
  const std::size_t split = at(axis < 0 ? axis + rank : axis);
  copy_as(call, in, {product(in.shape, 0, split), product(in.shape, split, in.shape.size())});
}

void unsqueeze(Call& call) {
  const Array& in = call.input(0);
  const auto axes = axes_of(call);
  const std::size_t rank = in.shape.size() + axes.size();
  std::vector<bool> added(rank, false);
  for (const std::int64_t axis : axes) {
    const std::size_t d = axis_of(axis, rank);
    expect(!added[d], "axis " + std::to_string(axis) + " is there twice");
    added[d] = true;
  }
  Shape shape;
  std::size_t next = 0;
  for (std::size_t d = 0; d < rank; ++d) shape.push_back(added[d] ? 1 : in.shape[next++]);
  copy_as(call, in, shape);
}

void squeeze(Call& call) {
  const Array& in = call.input(0);
  const auto axes = axes_of(call);
  std::vector<bool> removed(in.shape.size(), false);
  for (const std::int64_t axis : axes) removed[axis_of(axis, in.shape.size())] = true;
  Shape shape;
  for (std::size_t d = 0; d < in.shape.size(); ++d) {
    expect(!removed[d] || in.shape[d] == 1, "removes dimension " + std::to_string(d) + " of " + shape_text(in.shape));
    if (axes.empty() ? in.shape[d] != 1 : !removed[d]) shape.push_back(in.shape[d]);
  }
  copy_as(call, in, shape);
}

}  // namespace gatefield::model::operators
