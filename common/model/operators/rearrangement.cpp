#include "common/model/operators/rearrangement.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {

void transpose(Call& call) {
  const Array& in = call.input(0);
  Shape order(in.shape.size());
  std::iota(order.rbegin(), order.rend(), 0);
  order = call.integers("perm", order);
  Shape sorted = order, plain(in.shape.size());
  std::sort(sorted.begin(), sorted.end());
  std::iota(plain.begin(), plain.end(), 0);
  expect(sorted == plain, "perm is " + shape_text(order) + " for an input of shape " + shape_text(in.shape));
  const Shape own = strides_of(in.shape);
  Shape shape, strides;
  for (const std::int64_t d : order) {
    shape.push_back(in.shape[at(d)]);
    strides.push_back(own[at(d)]);
  }
  copy_view(in, &call.result(shape, in.integer), shape, strides);
}

void concat(Call& call) {
  Shape shape = call.input(0).shape;
  const std::size_t axis = axis_of(call.integer("axis", 0), shape.size());
  bool integer = true;
  shape[axis] = 0;
  for (std::size_t i = 0; i < call.in.size(); ++i) {
    Shape other = call.input(i).shape;
    expect(other.size() == shape.size(), "joins " + shape_text(call.input(0).shape) + " and " + shape_text(other));
    const std::int64_t along = std::exchange(other[axis], shape[axis]);
    expect(other == shape, "joins " + shape_text(call.input(0).shape) + " and " + shape_text(call.input(i).shape));
    shape[axis] += along;
    integer = integer && call.input(i).integer;
  }
  Array& out = call.result(shape, integer);
  const std::int64_t outer = product(shape, 0, axis), inner = product(shape, axis + 1, shape.size());
  std::int64_t before = 0;
  for (const Array* in : call.in) {
    const std::int64_t block = in->shape[axis] * inner;
    for (std::int64_t o = 0; o < outer; ++o) {
      std::copy_n(in->values.begin() + o * block, block, out.values.begin() + o * shape[axis] * inner + before);
    }
    before += block;
  }
}

void slice(Call& call) {
  const Array& in = call.input(0);
  const auto starts = integers_of(call.input(1)), ends = integers_of(call.input(2));
  Shape axes(starts.size());
  std::iota(axes.begin(), axes.end(), 0);
  if (call.has(3)) axes = integers_of(call.input(3));
  Shape steps(starts.size(), 1);
  if (call.has(4)) steps = integers_of(call.input(4));
  expect(starts.size() == ends.size() && starts.size() == axes.size() && starts.size() == steps.size(),
         "has starts, ends, axes and steps of different lengths");
  Shape shape = in.shape, strides = strides_of(in.shape);
  std::int64_t offset = 0;
  std::vector<bool> done(in.shape.size(), false);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const std::size_t d = axis_of(axes[i], in.shape.size());
    expect(!done[d], "cuts axis " + std::to_string(axes[i]) + " twice");
    done[d] = true;
    const std::int64_t size = in.shape[d], step = steps[i];
    expect(step != 0, "has a step of 0");
    const auto bound = [&](std::int64_t x) { return x < 0 ? x + size : x; };
    const std::int64_t low = step > 0 ? 0 : -1, high = step > 0 ? size : size - 1;
    const std::int64_t first = std::clamp(bound(starts[i]), std::int64_t{0}, std::max(high, std::int64_t{0}));
    const std::int64_t last = std::clamp(bound(ends[i]), low, high);
    const std::int64_t span = step > 0 ? last - first : first - last;
    const std::int64_t stride = step > 0 ? step : -step;
    shape[d] = size == 0 || span <= 0 ? 0 : (span + stride - 1) / stride;
    offset += shape[d] == 0 ? 0 : first * strides[d];
    strides[d] = shape[d] <= 1 ? 0 : strides[d] * step;
  }
  copy_view(in, &call.result(shape, in.integer), shape, strides, offset);
}

void split(Call& call) {
  const Array& in = call.input(0);
  const std::size_t axis = axis_of(call.integer("axis", 0), in.shape.size());
  const auto parts = static_cast<std::int64_t>(call.node.outputs.size());
  Shape sizes = call.has(1) ? integers_of(call.input(1)) : call.integers("split", {});
  if (sizes.empty()) {  // from operator set 18 on the last part may be smaller
    const std::int64_t size = (in.shape[axis] + parts - 1) / parts, last = in.shape[axis] - size * (parts - 1);
    expect(call.integer("num_outputs", parts) == parts && last >= 0 && (last == size || call.opset >= 18),
           "can't cut " + shape_text(in.shape) + " into " + std::to_string(parts) + " equal parts");
    sizes.assign(at(parts), size);
    sizes.back() = last;
  }
  std::int64_t sum = 0;
  for (const std::int64_t size : sizes) {
    expect(size >= 0 && size <= in.shape[axis], "has a part of size " + std::to_string(size));
    sum += size;
  }
  expect(static_cast<std::int64_t>(sizes.size()) == parts && sum == in.shape[axis],
         "cuts " + shape_text(in.shape) + " into " + shape_text(sizes) + " for " + std::to_string(parts) + " outputs");
  const Shape strides = strides_of(in.shape);
  std::int64_t before = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    Shape shape = in.shape;
    shape[axis] = sizes[i];
    copy_view(in, &call.result(shape, in.integer, i), shape, strides, before * strides[axis]);
    before += sizes[i];
  }
}

void expand(Call& call) {
  const Array& in = call.input(0);
  const Shape shape = broadcast(in.shape, integers_of(call.input(1)));
  copy_view(in, &call.result(shape, in.integer), shape, spread_strides(in.shape, shape));
}

void tile(Call& call) {
  const Array& in = call.input(0);
  const auto repeats = integers_of(call.input(1));
  expect(repeats.size() == in.shape.size(),
         "has " + std::to_string(repeats.size()) + " repeats for " + shape_text(in.shape));
  const Shape own = strides_of(in.shape);
  Shape shape, view, strides;  // every dimension as two: which copy, where in it
  for (std::size_t d = 0; d < in.shape.size(); ++d) {
    expect(repeats[d] >= 0, "repeats " + std::to_string(repeats[d]) + " times");
    shape.push_back(product({repeats[d], in.shape[d]}));
    view.insert(view.end(), {repeats[d], in.shape[d]});
    strides.insert(strides.end(), {0, own[d]});
  }
  copy_view(in, &call.result(shape, in.integer), view, strides);
}

void gather(Call& call) {
  const Array &in = call.input(0), &index = call.input(1);
  expect(index.integer, "has indices that are no integers");
  const std::size_t axis = axis_of(call.integer("axis", 0), in.shape.size());
  Shape shape(in.shape.begin(), in.shape.begin() + static_cast<std::ptrdiff_t>(axis));
  shape.insert(shape.end(), index.shape.begin(), index.shape.end());
  shape.insert(shape.end(), in.shape.begin() + static_cast<std::ptrdiff_t>(axis) + 1, in.shape.end());
  Array& out = call.result(shape, in.integer);
  const std::int64_t outer = product(in.shape, 0, axis), inner = product(in.shape, axis + 1, in.shape.size());
  const std::int64_t size = in.shape[axis];
  auto to = out.values.begin();
  for (std::int64_t o = 0; o < outer; ++o) {
    for (const double value : index.values) {
      std::int64_t i = to_integer(value);
      if (i < -size || i >= size) throw Refusal("takes element " + std::to_string(i) + " of " + std::to_string(size));
      if (i < 0) i += size;
      to = std::copy_n(in.values.begin() + (o * size + i) * inner, inner, to);
    }
  }
}

void pad(Call& call) {
  expect(call.word("mode", "constant") == "constant", "has mode '" + call.word("mode", "") + "', expected 'constant'");
  const Array& in = call.input(0);
  const auto pads = integers_of(call.input(1));
  const std::size_t rank = in.shape.size();
  expect(pads.size() == 2 * rank, "has " + std::to_string(pads.size()) + " pads for " + shape_text(in.shape));
  expect(!call.has(2) || call.input(2).values.size() == 1, "fills with more than one number");
  expect(!call.has(3), "has axes, expected pads of all dimensions");
  Shape shape = in.shape;
  for (std::size_t d = 0; d < rank; ++d) {
    expect(pads[d] >= 0 && pads[d + rank] >= 0 && pads[d] < kFar && pads[d + rank] < kFar,
           "pads by " + shape_text(pads) + ", expected nothing negative");
    shape[d] += pads[d] + pads[d + rank];
  }
  Array& out = call.result(shape, in.integer);
  std::fill(out.values.begin(), out.values.end(), call.has(2) ? call.input(2).values[0] : 0.0);
  const Shape to = strides_of(shape);
  std::int64_t offset = 0;
  for (std::size_t d = 0; d < rank; ++d) offset += pads[d] * to[d];
  walk<1>(in.shape, {to}, {offset},
          [&](std::int64_t n, const auto& where_to) { out.values[at(where_to[0])] = in.values[at(n)]; });
}

}  // namespace gatefield::model::operators
