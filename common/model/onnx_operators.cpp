#include "common/model/onnx_operators.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "common/model/onnx_file.h"

namespace gatefield::model {
namespace {

using Shape = std::vector<std::int64_t>;

constexpr std::size_t kMaxRank = 8;
constexpr std::int64_t kFar = std::int64_t{1} << 40;  ///< numbers that stand for 'to the end' saturate here

void expect(bool good, const std::string& otherwise) {
  if (!good) throw Refusal(otherwise);
}

std::size_t at(std::int64_t index) { return static_cast<std::size_t>(index); }

/// Sizes come from the file, so that their product may overflow; saturates far above every budget.
std::int64_t product(const Shape& shape, std::size_t from, std::size_t to) {
  double count = 1.0;
  for (std::size_t i = from; i < to; ++i) count *= static_cast<double>(shape[i]);
  return count > static_cast<double>(kFar) ? kFar : static_cast<std::int64_t>(count);
}
std::int64_t product(const Shape& shape) { return product(shape, 0, shape.size()); }

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

/// Axis -1 is the last one.
std::size_t axis_of(std::int64_t axis, std::size_t rank) {
  const auto n = static_cast<std::int64_t>(rank);
  expect(axis >= -n && axis < n,
         "axis is " + std::to_string(axis) + " for an input of " + std::to_string(rank) + " dimensions");
  return at(axis < 0 ? axis + n : axis);
}

Shape strides_of(const Shape& shape) {
  Shape strides(shape.size(), 1);
  for (std::size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return strides;
}

/// Calls visit(offset of every operand) for each element of `shape` in order; strides[operand][dimension].
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

/// The shape that both spread to.
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

/// Strides that read an array of `shape` as if it had been spread to `to`. @pre it spreads to it
Shape spread_strides(const Shape& shape, const Shape& to) {
  const Shape own = strides_of(shape);
  Shape strides(to.size(), 0);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] != 1) strides[to.size() - shape.size() + i] = own[i];
  }
  return strides;
}

/// A view copied: out[i...] = in[offset + sum strides[d] i_d].
void copy_view(const Array& in, Array* out, const Shape& view, const Shape& strides, std::int64_t offset = 0) {
  walk<1>(view, {strides}, {offset},
          [&](std::int64_t n, const auto& from) { out->values[at(n)] = in.values[at(from[0])]; });
}

void copy_as(Call& call, const Array& in, const Shape& shape) {
  expect(product(shape) == static_cast<std::int64_t>(in.values.size()),
         "can't make shape " + shape_text(shape) + " of " + shape_text(in.shape));
  call.result(shape, in.integer).values = in.values;
}

// --- element by element ---

template <double (*kFunction)(double)>
void unary(Call& call) {
  const Array& in = call.input(0);
  Array& out = call.result(in.shape, in.integer);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), kFunction);
}

double relu(double x) { return x > 0.0 ? x : 0.0; }
double sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }
double hard_swish(double x) { return x * std::clamp(x / 6.0 + 0.5, 0.0, 1.0); }
double softplus(double x) { return x > 30.0 ? x : std::log1p(std::exp(x)); }
double negative(double x) { return -x; }
double reciprocal(double x) { return 1.0 / x; }

template <typename Function>
void each(Call& call, Function&& function) {
  const Array& in = call.input(0);
  Array& out = call.result(in.shape, in.integer);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), function);
}

void leaky_relu(Call& call) {
  each(call, [alpha = call.number("alpha", 0.01)](double x) { return x < 0.0 ? alpha * x : x; });
}
void elu(Call& call) {
  each(call, [alpha = call.number("alpha", 1.0)](double x) { return x < 0.0 ? alpha * std::expm1(x) : x; });
}
void hard_sigmoid(Call& call) {
  each(call, [alpha = call.number("alpha", 0.2), beta = call.number("beta", 0.5)](double x) {
    return std::max(0.0, std::min(1.0, alpha * x + beta));
  });
}

void clip(Call& call) {
  const auto bound = [&](std::size_t i, double otherwise) {
    if (!call.has(i)) return otherwise;
    expect(call.input(i).values.size() == 1,
           "a bound of shape " + shape_text(call.input(i).shape) + ", expected one number");
    return call.input(i).values[0];
  };
  const double low = bound(1, -std::numeric_limits<double>::infinity());
  const double high = bound(2, std::numeric_limits<double>::infinity());
  each(call, [&](double x) { return std::min(std::max(x, low), high); });
}

void cast(Call& call) {
  const Array& in = call.input(0);
  const std::int64_t to = call.integer("to", 0);
  const bool boolean = to == onnx::TensorProto::BOOL;
  const bool integer = boolean || to == onnx::TensorProto::INT32 || to == onnx::TensorProto::INT64;
  expect(integer || to == onnx::TensorProto::FLOAT,
         "casts to ONNX data type " + std::to_string(to) + ", expected 1 (float), 6 (int32), 7 (int64) or 9 (bool)");
  Array& out = call.result(in.shape, integer);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), [&](double x) {
    if (boolean) return x != 0.0 ? 1.0 : 0.0;
    return integer ? static_cast<double>(to_integer(x)) : x;
  });
}

void combine(Call& call, const Array& a, const Array& b, bool integer, const std::function<double(double, double)>& f) {
  const Shape shape = broadcast(a.shape, b.shape);
  Array& out = call.result(shape, integer);
  walk<2>(
      shape, {spread_strides(a.shape, shape), spread_strides(b.shape, shape)}, {0, 0},
      [&](std::int64_t n, const auto& from) { out.values[at(n)] = f(a.values[at(from[0])], b.values[at(from[1])]); });
}

template <double (*kFunction)(double, double)>
void binary(Call& call) {
  const Array &a = call.input(0), &b = call.input(1);
  combine(call, a, b, a.integer && b.integer, kFunction);
}

double add(double a, double b) { return a + b; }
double subtract(double a, double b) { return a - b; }
double multiply(double a, double b) { return a * b; }
double power(double a, double b) { return std::pow(a, b); }
double prelu(double x, double slope) { return x < 0.0 ? slope * x : x; }

void divide(Call& call) {
  const Array &a = call.input(0), &b = call.input(1);
  const bool integer = a.integer && b.integer;
  combine(call, a, b, integer, [integer](double x, double y) {
    if (!integer) return x / y;
    if (y == 0.0) throw Refusal("divides an integer by zero");
    return std::trunc(x / y);
  });
}

void equal(Call& call) {
  combine(call, call.input(0), call.input(1), true, [](double x, double y) { return x == y ? 1.0 : 0.0; });
}

void where(Call& call) {
  const Array &which = call.input(0), &yes = call.input(1), &no = call.input(2);
  const Shape shape = broadcast(broadcast(which.shape, yes.shape), no.shape);
  Array& out = call.result(shape, yes.integer && no.integer);
  walk<3>(shape,
          {spread_strides(which.shape, shape), spread_strides(yes.shape, shape), spread_strides(no.shape, shape)},
          {0, 0, 0}, [&](std::int64_t n, const auto& from) {
            out.values[at(n)] = which.values[at(from[0])] != 0.0 ? yes.values[at(from[1])] : no.values[at(from[2])];
          });
}

template <bool kMax>
void extremes(Call& call) {
  Array sofar = call.input(0);
  for (std::size_t i = 1; i < call.in.size(); ++i) {
    combine(call, sofar, call.input(i), sofar.integer && call.input(i).integer,
            [](double a, double b) { return kMax ? std::max(a, b) : std::min(a, b); });
    sofar = *call.out[0];
  }
  call.result(sofar.shape, sofar.integer).values = std::move(sofar.values);
}

// --- shapes ---

void shape_operator(Call& call) {
  const Shape& shape = call.input(0).shape;
  Array& out = call.result({static_cast<std::int64_t>(shape.size())}, true);
  std::copy(shape.begin(), shape.end(), out.values.begin());
}

void constant_of_shape(Call& call) {
  const auto value = call.node.attributes.find("value");
  const bool given = value != call.node.attributes.end();
  Array& out = call.result(integers_of(call.input(0)), given && value->second.integer != 0);
  std::fill(out.values.begin(), out.values.end(), given ? value->second.number : 0.0);
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

/// Axes: an attribute up to operator set 12, an input after it (torch writes either for some operators).
std::vector<std::int64_t> axes_of(Call& call) {
  if (call.has(1)) return integers_of(call.input(1));
  return call.integers("axes", {});
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
  if (sizes.empty()) {
    expect(in.shape[axis] % parts == 0,
           "can't cut " + shape_text(in.shape) + " into " + std::to_string(parts) + " equal parts");
    sizes.assign(at(parts), in.shape[axis] / parts);
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

// --- over windows ---

/// Kernel, steps and edges of a convolution or pooling over two dimensions.
struct Window {
  std::int64_t kernel[2], stride[2], dilation[2], before[2], size[2];  // size: of the output

  Window(Call& call, const Shape& in, const Shape& kernel_shape) {
    expect(in.size() == 4, "has an input of shape " + shape_text(in) + ", expected [batch, channels, rows, columns]");
    expect(kernel_shape.size() == 2, "has a kernel of shape " + shape_text(kernel_shape) + ", expected two sizes");
    expect(call.word("auto_pad", "NOTSET") == "NOTSET",
           "has auto_pad '" + call.word("auto_pad", "") + "', expected pads in numbers");
    expect(call.integer("ceil_mode", 0) == 0, "has ceil_mode 1, expected 0");
    const Shape strides = call.integers("strides", {1, 1}), dilations = call.integers("dilations", {1, 1}),
                pads = call.integers("pads", {0, 0, 0, 0});
    expect(strides.size() == 2 && dilations.size() == 2 && pads.size() == 4,
           "has strides, dilations or pads of the wrong length, expected 2, 2 and 4");
    for (std::size_t i = 0; i < 2; ++i) {
      const auto sane = [](std::int64_t x, std::int64_t low) { return x >= low && x <= 1024; };
      expect(sane(kernel_shape[i], 1) && sane(strides[i], 1) && sane(dilations[i], 1) && sane(pads[i], 0) &&
                 sane(pads[i + 2], 0),
             "has a kernel, stride, dilation or pad out of range (up to 1024)");
      kernel[i] = kernel_shape[i];
      stride[i] = strides[i];
      dilation[i] = dilations[i];
      before[i] = pads[i];
      const std::int64_t room = in[2 + i] + pads[i] + pads[i + 2] - (kernel[i] - 1) * dilation[i] - 1;
      expect(room >= 0, "has a kernel larger than its input " + shape_text(in));
      size[i] = room / stride[i] + 1;
    }
  }
  /// Where the window of output `o` begins, along dimension i.
  std::int64_t from(std::size_t i, std::int64_t o) const { return o * stride[i] - before[i]; }
};

void conv(Call& call) {
  const Array &in = call.input(0), &weight = call.input(1);
  expect(weight.shape.size() == 4, "has a kernel of shape " + shape_text(weight.shape) + ", expected four sizes");
  const Window window(call, in.shape, {weight.shape[2], weight.shape[3]});
  const Shape said = call.integers("kernel_shape", {weight.shape[2], weight.shape[3]});
  expect(said == Shape({weight.shape[2], weight.shape[3]}),
         "says kernel_shape " + shape_text(said) + " but has weights of shape " + shape_text(weight.shape));
  const std::int64_t groups = call.integer("group", 1), outputs = weight.shape[0], inputs = in.shape[1];
  expect(groups >= 1 && groups <= inputs && inputs % groups == 0 && outputs % groups == 0 &&
             weight.shape[1] == inputs / groups,
         "has weights of shape " + shape_text(weight.shape) + " and group " + std::to_string(groups) +
             " for an input of shape " + shape_text(in.shape));
  expect(!call.has(2) || call.input(2).shape == Shape({outputs}),
         "has a bias that doesn't fit its weights " + shape_text(weight.shape));
  const std::int64_t rows = window.size[0], columns = window.size[1], height = in.shape[2], width = in.shape[3];
  Array& out = call.result({in.shape[0], outputs, rows, columns}, false);
  call.spend(static_cast<double>(out.values.size()) * static_cast<double>(product(weight.shape, 1, 4)));

  for (std::int64_t n = 0; n < in.shape[0]; ++n) {
    for (std::int64_t o = 0; o < outputs; ++o) {
      double* const plane = out.values.data() + (n * outputs + o) * rows * columns;
      std::fill_n(plane, rows * columns, call.has(2) ? call.input(2).values[at(o)] : 0.0);
      const std::int64_t first = o / (outputs / groups) * (inputs / groups);
      for (std::int64_t c = 0; c < inputs / groups; ++c) {
        const double* const image = in.values.data() + (n * inputs + first + c) * height * width;
        const double* const kernel =
            weight.values.data() + (o * (inputs / groups) + c) * window.kernel[0] * window.kernel[1];
        for (std::int64_t i = 0; i < window.kernel[0]; ++i) {
          for (std::int64_t j = 0; j < window.kernel[1]; ++j) {
            const double w = kernel[i * window.kernel[1] + j];
            // Columns x whose sample shift + stride x lies in the image.
            const std::int64_t shift = j * window.dilation[1] - window.before[1], stride = window.stride[1];
            const std::int64_t begin = shift >= 0 ? 0 : (-shift + stride - 1) / stride;
            const std::int64_t end = shift >= width ? 0 : std::min(columns, (width - 1 - shift) / stride + 1);
            for (std::int64_t y = 0; y < rows; ++y) {
              const std::int64_t row = window.from(0, y) + i * window.dilation[0];
              if (row < 0 || row >= height) continue;
              const double* const line = image + row * width + shift;
              for (std::int64_t x = begin; x < end; ++x) plane[y * columns + x] += w * line[x * stride];
            }
          }
        }
      }
    }
  }
}

template <bool kMax>
void pool(Call& call) {
  const Array& in = call.input(0);
  const Window window(call, in.shape, call.integers("kernel_shape", {}));
  const bool count_pads = call.integer("count_include_pad", 0) != 0;
  expect(call.integer("storage_order", 0) == 0, "has storage_order 1, expected 0");
  const std::int64_t rows = window.size[0], columns = window.size[1], height = in.shape[2], width = in.shape[3];
  const std::int64_t planes = in.shape[0] * in.shape[1];
  Array& out = call.result({in.shape[0], in.shape[1], rows, columns}, false);
  call.spend(static_cast<double>(out.values.size()) * static_cast<double>(window.kernel[0] * window.kernel[1]));
  for (std::int64_t n = 0; n < planes * rows * columns; ++n) {
    const std::int64_t plane = n / (rows * columns), y = n / columns % rows, x = n % columns;
    double sum = 0.0, most = -std::numeric_limits<double>::infinity();
    std::int64_t count = 0;
    for (std::int64_t i = 0; i < window.kernel[0]; ++i) {
      const std::int64_t row = window.from(0, y) + i * window.dilation[0];
      if (row < 0 || row >= height) continue;
      for (std::int64_t j = 0; j < window.kernel[1]; ++j) {
        const std::int64_t column = window.from(1, x) + j * window.dilation[1];
        if (column < 0 || column >= width) continue;
        const double value = in.values[at((plane * height + row) * width + column)];
        sum += value;
        most = std::max(most, value);
        ++count;
      }
    }
    if (count == 0) throw Refusal("has a window that lies in the padding as a whole");
    out.values[at(n)] =
        kMax ? most : sum / static_cast<double>(count_pads ? window.kernel[0] * window.kernel[1] : count);
  }
}

template <bool kMax>
void global_pool(Call& call) {
  const Array& in = call.input(0);
  expect(in.shape.size() >= 3,
         "has an input of shape " + shape_text(in.shape) + ", expected [batch, channels, rows, columns]");
  Shape shape(in.shape.size(), 1);
  shape[0] = in.shape[0];
  shape[1] = in.shape[1];
  const std::int64_t size = product(in.shape, 2, in.shape.size());
  expect(size > 0, "has an empty input");
  Array& out = call.result(shape, false);
  for (std::size_t n = 0; n < out.values.size(); ++n) {
    const auto first = in.values.begin() + static_cast<std::ptrdiff_t>(n) * size;
    out.values[n] = kMax ? *std::max_element(first, first + size)
                         : std::accumulate(first, first + size, 0.0) / static_cast<double>(size);
  }
}

/// Numbers per channel of `in`.
const std::vector<double>& per_channel(Call& call, std::size_t i) {
  const Array& in = call.input(0);
  expect(in.shape.size() >= 2 && call.input(i).shape == Shape({in.shape[1]}),
         "has an input " + std::to_string(i) + " of shape " + shape_text(call.input(i).shape) + " for " +
             shape_text(in.shape));
  return call.input(i).values;
}

void batch_normalization(Call& call) {
  expect(call.integer("training_mode", 0) == 0, "is in training mode; call .eval() before the export");
  const Array& in = call.input(0);
  const double epsilon = call.number("epsilon", 1e-5);
  const auto &scale = per_channel(call, 1), &shift = per_channel(call, 2), &mean = per_channel(call, 3),
             &variance = per_channel(call, 4);
  Array& out = call.result(in.shape, false);
  const std::int64_t size = product(in.shape, 2, in.shape.size());
  for (std::size_t n = 0; n < out.values.size(); ++n) {
    const std::size_t c = n / at(size) % scale.size();
    out.values[n] = (in.values[n] - mean[c]) / std::sqrt(variance[c] + epsilon) * scale[c] + shift[c];
  }
}

void instance_normalization(Call& call) {
  const Array& in = call.input(0);
  const double epsilon = call.number("epsilon", 1e-5);
  const auto &scale = per_channel(call, 1), &shift = per_channel(call, 2);
  Array& out = call.result(in.shape, false);
  const std::size_t size = at(product(in.shape, 2, in.shape.size()));
  for (std::size_t begin = 0; begin < out.values.size(); begin += size) {
    double mean = 0.0, variance = 0.0;
    for (std::size_t i = 0; i < size; ++i) mean += in.values[begin + i] / static_cast<double>(size);
    for (std::size_t i = 0; i < size; ++i) {
      const double d = in.values[begin + i] - mean;
      variance += d * d / static_cast<double>(size);
    }
    const std::size_t c = begin / size % scale.size();
    for (std::size_t i = 0; i < size; ++i) {
      out.values[begin + i] = (in.values[begin + i] - mean) / std::sqrt(variance + epsilon) * scale[c] + shift[c];
    }
  }
}

// --- matrices ---

/// out [m][n] += a [m][k] b [k][n], with free strides.
void multiply_add(const double* a, std::int64_t a_row, std::int64_t a_column, const double* b, std::int64_t b_row,
                  std::int64_t b_column, double* out, std::int64_t m, std::int64_t k, std::int64_t n, double factor) {
  for (std::int64_t i = 0; i < m; ++i) {
    for (std::int64_t l = 0; l < k; ++l) {
      const double x = factor * a[i * a_row + l * a_column];
      for (std::int64_t j = 0; j < n; ++j) out[i * n + j] += x * b[l * b_row + j * b_column];
    }
  }
}

void gemm(Call& call) {
  const Array &a = call.input(0), &b = call.input(1);
  expect(a.shape.size() == 2 && b.shape.size() == 2,
         "multiplies " + shape_text(a.shape) + " and " + shape_text(b.shape) + ", expected two matrices");
  const bool trans_a = call.integer("transA", 0) != 0, trans_b = call.integer("transB", 0) != 0;
  const std::int64_t m = a.shape[trans_a], k = a.shape[!trans_a], n = b.shape[!trans_b];
  expect(b.shape[trans_b] == k,
         "multiplies " + shape_text(a.shape) + " and " + shape_text(b.shape) + ", which don't fit");
  Array& out = call.result({m, n}, false);
  call.spend(static_cast<double>(m) * static_cast<double>(k) * static_cast<double>(n));
  if (call.has(2)) {
    const Array& c = call.input(2);
    expect(broadcast(c.shape, out.shape) == out.shape, "adds " + shape_text(c.shape) + " to " + shape_text(out.shape));
    const double beta = call.number("beta", 1.0);
    walk<1>(out.shape, {spread_strides(c.shape, out.shape)}, {0},
            [&](std::int64_t i, const auto& from) { out.values[at(i)] = beta * c.values[at(from[0])]; });
  }
  multiply_add(a.values.data(), trans_a ? 1 : k, trans_a ? m : 1, b.values.data(), trans_b ? 1 : n, trans_b ? k : 1,
               out.values.data(), m, k, n, call.number("alpha", 1.0));
}

void matmul(Call& call) {
  const Array &a = call.input(0), &b = call.input(1);
  expect(a.shape.size() >= 2 && b.shape.size() >= 2,
         "multiplies " + shape_text(a.shape) + " and " + shape_text(b.shape) + ", expected at least two dimensions");
  const std::int64_t m = a.shape[a.shape.size() - 2], k = a.shape.back(), n = b.shape.back();
  expect(b.shape[b.shape.size() - 2] == k,
         "multiplies " + shape_text(a.shape) + " and " + shape_text(b.shape) + ", which don't fit");
  const Shape a_batch(a.shape.begin(), a.shape.end() - 2), b_batch(b.shape.begin(), b.shape.end() - 2);
  const Shape batch = broadcast(a_batch, b_batch);
  Shape shape = batch;
  shape.insert(shape.end(), {m, n});
  Array& out = call.result(shape, false);
  call.spend(static_cast<double>(product(batch)) * static_cast<double>(m) * static_cast<double>(k) *
             static_cast<double>(n));
  walk<2>(batch, {spread_strides(a_batch, batch), spread_strides(b_batch, batch)}, {0, 0},
          [&](std::int64_t i, const auto& from) {
            multiply_add(a.values.data() + from[0] * m * k, k, 1, b.values.data() + from[1] * k * n, n, 1,
                         out.values.data() + i * m * n, m, k, n, 1.0);
          });
}

void softmax(Call& call) {
  const Array& in = call.input(0);
  const bool flat = call.opset < 13;  // up to 12: over everything from the axis on
  expect(!in.shape.empty(), "has an input without dimensions");
  const std::size_t axis = axis_of(call.integer("axis", flat ? 1 : -1), in.shape.size());
  const std::int64_t size = flat ? product(in.shape, axis, in.shape.size()) : in.shape[axis];
  const std::int64_t inner = flat ? 1 : product(in.shape, axis + 1, in.shape.size());
  Array& out = call.result(in.shape, false);
  if (out.values.empty()) return;
  const std::int64_t outer = static_cast<std::int64_t>(out.values.size()) / (size * inner);
  for (std::int64_t o = 0; o < outer * inner; ++o) {
    const std::int64_t begin = o / inner * size * inner + o % inner;
    double most = -std::numeric_limits<double>::infinity(), sum = 0.0;
    for (std::int64_t i = 0; i < size; ++i) most = std::max(most, in.values[at(begin + i * inner)]);
    for (std::int64_t i = 0; i < size; ++i)
      sum += out.values[at(begin + i * inner)] = std::exp(in.values[at(begin + i * inner)] - most);
    for (std::int64_t i = 0; i < size; ++i) out.values[at(begin + i * inner)] /= sum;
  }
}

enum class Reduction { kSum, kMean, kMax, kMin, kProduct, kL2 };

template <Reduction kKind>
void reduce(Call& call) {
  const Array& in = call.input(0);
  const auto axes = axes_of(call);
  const bool all = axes.empty() && call.integer("noop_with_empty_axes", 0) == 0;
  std::vector<bool> gone(in.shape.size(), all);
  for (const std::int64_t axis : axes) gone[axis_of(axis, in.shape.size())] = true;
  const bool keep = call.integer("keepdims", 1) != 0;
  Shape shape, strides(in.shape.size(), 0);
  for (std::size_t d = 0; d < in.shape.size(); ++d) {
    if (!gone[d] || keep) shape.push_back(gone[d] ? 1 : in.shape[d]);
  }
  std::int64_t stride = 1, count = 1;
  for (std::size_t d = in.shape.size(); d-- > 0;) {
    if (gone[d]) {
      count = product({count, in.shape[d]});
    } else {
      strides[d] = stride;
      stride *= in.shape[d];
    }
  }
  expect(count > 0, "has an empty input");
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Array& out = call.result(shape, in.integer && kKind != Reduction::kMean && kKind != Reduction::kL2);
  std::fill(out.values.begin(), out.values.end(),
            kKind == Reduction::kMax       ? -kInfinity
            : kKind == Reduction::kMin     ? kInfinity
            : kKind == Reduction::kProduct ? 1.0
                                           : 0.0);
  walk<1>(in.shape, {strides}, {0}, [&](std::int64_t n, const auto& to) {
    const double x = in.values[at(n)];
    double& sofar = out.values[at(to[0])];
    switch (kKind) {
      case Reduction::kSum:
      case Reduction::kMean:
        sofar += x;
        break;
      case Reduction::kMax:
        sofar = std::max(sofar, x);
        break;
      case Reduction::kMin:
        sofar = std::min(sofar, x);
        break;
      case Reduction::kProduct:
        sofar *= x;
        break;
      case Reduction::kL2:
        sofar += x * x;
        break;
    }
  });
  for (double& x : out.values) {
    if (kKind == Reduction::kMean) x /= static_cast<double>(count);
    if (kKind == Reduction::kL2) x = std::sqrt(x);
  }
}

/// Enlarges along one dimension: out = low (1 - w) + high w of input elements, the same for all others.
void resize(Call& call) {
  const Array& in = call.input(0);
  const std::string mode = call.word("mode", "nearest");
  const std::string where_from = call.word("coordinate_transformation_mode", "half_pixel");
  const std::string rounding = call.word("nearest_mode", "round_prefer_floor");
  expect(mode == "nearest" || mode == "linear", "has mode '" + mode + "', expected 'nearest' or 'linear'");
  expect(where_from == "half_pixel" || where_from == "pytorch_half_pixel" || where_from == "align_corners" ||
             where_from == "asymmetric",
         "has coordinate_transformation_mode '" + where_from + "'");
  expect(
      rounding == "round_prefer_floor" || rounding == "round_prefer_ceil" || rounding == "floor" || rounding == "ceil",
      "has nearest_mode '" + rounding + "'");
  expect(call.integer("exclude_outside", 0) == 0, "has exclude_outside 1, expected 0");
  const std::size_t rank = in.shape.size();
  const bool sized = call.has(3) && !call.input(3).values.empty();
  expect(sized || (call.has(2) && call.input(2).values.size() == rank),
         "has neither scales nor sizes for " + shape_text(in.shape));
  expect(!sized || call.input(3).values.size() == rank, "has sizes that don't fit " + shape_text(in.shape));

  Array now{in.shape, in.values, false};
  for (std::size_t d = 0; d < rank; ++d) {
    const std::int64_t before = in.shape[d];
    expect(before > 0, "has an empty input");
    double scale = sized ? static_cast<double>(to_integer(call.input(3).values[d])) / static_cast<double>(before)
                         : call.input(2).values[d];
    expect(scale > 0.0 && scale <= 4096.0,
           "enlarges by " + std::to_string(scale) + ", expected more than 0 up to 4096");
    const std::int64_t after =
        sized ? to_integer(call.input(3).values[d]) : to_integer(std::floor(static_cast<double>(before) * scale));
    expect(after >= 1, "makes dimension " + std::to_string(d) + " empty");
    if (after == before && scale == 1.0) continue;
    Shape shape = now.shape;
    shape[d] = after;
    Array& out = call.result(shape, false);
    const std::int64_t outer = product(shape, 0, d), inner = product(shape, d + 1, rank);
    for (std::int64_t i = 0; i < after; ++i) {
      const auto o = static_cast<double>(i);
      double x = 0.0;
      if (where_from == "asymmetric") {
        x = o / scale;
      } else if (where_from == "align_corners") {
        x = after == 1 ? 0.0 : o * static_cast<double>(before - 1) / static_cast<double>(after - 1);
      } else if (where_from == "half_pixel" || after > 1) {
        x = (o + 0.5) / scale - 0.5;
      }
      double w = 0.0;
      std::int64_t low = 0;
      if (mode == "linear") {
        low = to_integer(std::floor(x));
        w = x - std::floor(x);
      } else {
        low = to_integer(rounding == "floor"               ? std::floor(x)
                         : rounding == "ceil"              ? std::ceil(x)
                         : rounding == "round_prefer_ceil" ? std::floor(x + 0.5)
                                                           : std::ceil(x - 0.5));
      }
      const std::int64_t a = std::clamp(low, std::int64_t{0}, before - 1),
                         b = std::clamp(low + 1, std::int64_t{0}, before - 1);
      for (std::int64_t p = 0; p < outer; ++p) {
        for (std::int64_t q = 0; q < inner; ++q) {
          out.values[at((p * after + i) * inner + q)] = (1.0 - w) * now.values[at((p * before + a) * inner + q)] +
                                                        w * now.values[at((p * before + b) * inner + q)];
        }
      }
    }
    now = out;
  }
  call.result(now.shape, false).values = std::move(now.values);
}

double identity(double x) { return x; }

constexpr std::string_view kNone = " ";
constexpr std::string_view kReduced = " axes keepdims noop_with_empty_axes ";

/// One line each: type, what it does, fewest and most inputs, most outputs, attributes.
constexpr Operator kOperators[] = {
    {"Abs", unary<std::fabs>, 1, 1, 1, kNone},
    {"Add", binary<add>, 2, 2, 1, kNone},
    {"AveragePool", pool<false>, 1, 1, 1, " kernel_shape strides pads auto_pad ceil_mode count_include_pad "},
    {"BatchNormalization", batch_normalization, 5, 5, 1, " epsilon momentum training_mode "},
    {"Cast", cast, 1, 1, 1, " to "},
    {"Ceil", unary<std::ceil>, 1, 1, 1, kNone},
    {"Clip", clip, 1, 3, 1, kNone},
    {"Concat", concat, 1, 256, 1, " axis "},
    {"Constant", nullptr, 0, 0, 1, " value value_float value_floats value_int value_ints "},
    {"ConstantOfShape", constant_of_shape, 1, 1, 1, " value "},
    {"Conv", conv, 2, 3, 1, " auto_pad dilations group kernel_shape pads strides "},
    {"Cos", unary<std::cos>, 1, 1, 1, kNone},
    {"Div", divide, 2, 2, 1, kNone},
    {"Elu", elu, 1, 1, 1, " alpha "},
    {"Equal", equal, 2, 2, 1, kNone},
    {"Erf", unary<std::erf>, 1, 1, 1, kNone},
    {"Exp", unary<std::exp>, 1, 1, 1, kNone},
    {"Expand", expand, 2, 2, 1, kNone},
    {"Flatten", flatten, 1, 1, 1, " axis "},
    {"Floor", unary<std::floor>, 1, 1, 1, kNone},
    {"Gather", gather, 2, 2, 1, " axis "},
    {"Gemm", gemm, 2, 3, 1, " alpha beta transA transB "},
    {"GlobalAveragePool", global_pool<false>, 1, 1, 1, kNone},
    {"GlobalMaxPool", global_pool<true>, 1, 1, 1, kNone},
    {"HardSigmoid", hard_sigmoid, 1, 1, 1, " alpha beta "},
    {"HardSwish", unary<hard_swish>, 1, 1, 1, kNone},
    {"Identity", unary<identity>, 1, 1, 1, kNone},
    {"InstanceNormalization", instance_normalization, 3, 3, 1, " epsilon "},
    {"LeakyRelu", leaky_relu, 1, 1, 1, " alpha "},
    {"Log", unary<std::log>, 1, 1, 1, kNone},
    {"MatMul", matmul, 2, 2, 1, kNone},
    {"Max", extremes<true>, 1, 16, 1, kNone},
    {"MaxPool", pool<true>, 1, 1, 1, " kernel_shape strides pads auto_pad ceil_mode dilations storage_order "},
    {"Min", extremes<false>, 1, 16, 1, kNone},
    {"Mul", binary<multiply>, 2, 2, 1, kNone},
    {"Neg", unary<negative>, 1, 1, 1, kNone},
    {"PRelu", binary<prelu>, 2, 2, 1, kNone},
    {"Pad", pad, 2, 3, 1, " mode "},
    {"Pow", binary<power>, 2, 2, 1, kNone},
    {"Reciprocal", unary<reciprocal>, 1, 1, 1, kNone},
    {"ReduceL2", reduce<Reduction::kL2>, 1, 2, 1, kReduced},
    {"ReduceMax", reduce<Reduction::kMax>, 1, 2, 1, kReduced},
    {"ReduceMean", reduce<Reduction::kMean>, 1, 2, 1, kReduced},
    {"ReduceMin", reduce<Reduction::kMin>, 1, 2, 1, kReduced},
    {"ReduceProd", reduce<Reduction::kProduct>, 1, 2, 1, kReduced},
    {"ReduceSum", reduce<Reduction::kSum>, 1, 2, 1, kReduced},
    {"Relu", unary<relu>, 1, 1, 1, kNone},
    {"Reshape", reshape, 2, 2, 1, " allowzero "},
    {"Resize", resize, 2, 4, 1, " coordinate_transformation_mode cubic_coeff_a exclude_outside mode nearest_mode "},
    {"Shape", shape_operator, 1, 1, 1, kNone},
    {"Sigmoid", unary<sigmoid>, 1, 1, 1, kNone},
    {"Sin", unary<std::sin>, 1, 1, 1, kNone},
    {"Slice", slice, 3, 5, 1, kNone},
    {"Softmax", softmax, 1, 1, 1, " axis "},
    {"Softplus", unary<softplus>, 1, 1, 1, kNone},
    {"Split", split, 1, 2, 64, " axis split "},
    {"Sqrt", unary<std::sqrt>, 1, 1, 1, kNone},
    {"Squeeze", squeeze, 1, 2, 1, " axes "},
    {"Sub", binary<subtract>, 2, 2, 1, kNone},
    {"Tanh", unary<std::tanh>, 1, 1, 1, kNone},
    {"Tile", tile, 2, 2, 1, kNone},
    {"Transpose", transpose, 1, 1, 1, " perm "},
    {"Unsqueeze", unsqueeze, 1, 2, 1, " axes "},
    {"Where", where, 3, 3, 1, kNone},
};

}  // namespace

const Operator* find_operator(std::string_view type) {
  const auto* const found =
      std::find_if(std::begin(kOperators), std::end(kOperators), [&](const Operator& o) { return o.type == type; });
  return found == std::end(kOperators) ? nullptr : found;
}

bool known_operator(std::string_view type) { return find_operator(type) != nullptr; }

std::string operator_names() {
  std::string names;
  for (const Operator& o : kOperators) {
    if (!names.empty()) names += ", ";
    names += o.type;
  }
  return names;
}

const Array& Call::input(std::size_t i) const {
  expect(has(i), "lacks input " + std::to_string(i));
  return *in[i];
}

Array& Call::result(const std::vector<std::int64_t>& shape, bool integer, std::size_t i) {
  expect(shape.size() <= kMaxRank, "makes an array of " + std::to_string(shape.size()) +
                                       " dimensions, expected at most " + std::to_string(kMaxRank));
  double most = 1.0;  // without the empty dimensions: strides are products of the others
  for (const std::int64_t size : shape) {
    expect(size >= 0 && size <= kFar, "makes an array of the impossible shape " + shape_text(shape));
    most *= static_cast<double>(std::max(size, std::int64_t{1}));
  }
  expect(most <= static_cast<double>(left.numbers),
         "makes an array of shape " + shape_text(shape) + ", too large for a network of this kind");
  const std::int64_t count = product(shape);
  left.numbers -= count;
  out[i] = std::make_unique<Array>(Array{shape, std::vector<double>(at(count), 0.0), integer});
  return *out[i];
}

void Call::spend(double multiply_adds) {
  expect(multiply_adds <= static_cast<double>(left.multiply_adds), "takes more multiplications than are allowed");
  left.multiply_adds -= static_cast<std::int64_t>(multiply_adds);
}

std::int64_t Call::integer(const char* name, std::int64_t otherwise) const {
  const auto found = node.attributes.find(name);
  return found == node.attributes.end() ? otherwise : found->second.integer;
}
double Call::number(const char* name, double otherwise) const {
  const auto found = node.attributes.find(name);
  return found == node.attributes.end() ? otherwise : found->second.number;
}
std::string Call::word(const char* name, const char* otherwise) const {
  const auto found = node.attributes.find(name);
  return found == node.attributes.end() ? otherwise : found->second.word;
}
std::vector<std::int64_t> Call::integers(const char* name, std::vector<std::int64_t> otherwise) const {
  const auto found = node.attributes.find(name);
  return found == node.attributes.end() ? std::move(otherwise) : found->second.integers;
}

}  // namespace gatefield::model
