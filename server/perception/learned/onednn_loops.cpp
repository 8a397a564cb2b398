#include "server/perception/learned/onednn_loops.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

namespace gatefield::perception {
namespace {

using Shape = std::vector<std::int64_t>;

/// A node while its loop is made.
struct Site {
  const model::Graph& graph;
  const model::Node& node;
  const std::function<Numbers(int slot)>& numbers_of;

  std::size_t inputs() const { return node.inputs.size(); }
  const Shape& shape(std::size_t i) const { return graph.shape(node.inputs[i]); }
  const Shape& result() const { return graph.shape(node.outputs[0]); }
  Numbers numbers(std::size_t i) const { return numbers_of(node.inputs[i]); }
  /// The entries of an input that is a list of integers, the same for every image.
  std::optional<Shape> integers(std::size_t i) const {
    const model::Array* const array = graph.constant(node.inputs[i]);
    if (array == nullptr || !array->integer) return std::nullopt;
    Shape list;
    for (const double value : array->values) list.push_back(static_cast<std::int64_t>(std::clamp(value, -9e18, 9e18)));
    return list;
  }
};

std::int64_t product(const Shape& shape, std::size_t from, std::size_t to) {
  std::int64_t count = 1;
  for (std::size_t i = from; i < to; ++i) count *= shape[i];
  return count;
}
std::int64_t product(const Shape& shape) { return product(shape, 0, shape.size()); }

/// Axis -1 is the last one. @pre the graph was evaluated, so that the axis is one of `shape`
std::size_t axis_of(std::int64_t axis, const Shape& shape) {
  return static_cast<std::size_t>(axis < 0 ? axis + static_cast<std::int64_t>(shape.size()) : axis);
}

/// Strides that read an array of `shape` as if it had been spread to `wide`.
Shape strides_for(const Shape& shape, const Shape& wide) {
  Shape strides(wide.size(), 0);
  std::int64_t step = 1;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const std::size_t at = shape.size() - 1 - i, out = wide.size() - 1 - i;
    if (shape[at] != 1) strides[out] = step;
    step *= shape[at];
  }
  return strides;
}

template <typename Operation>
Result<Loop> elementwise(const Site& site, Operation operation) {
  const Shape &a = site.shape(0), &b = site.shape(1), &wide = site.result();
  const Numbers x = site.numbers(0), y = site.numbers(1);
  const std::int64_t count = product(wide);
  if (a == wide && (b == wide || product(b) == 1)) {
    const std::int64_t step = b == wide ? 1 : 0;
    return Loop([x, y, count, step, operation](float* to) {
      for (std::int64_t i = 0; i < count; ++i) to[i] = operation((*x)[i], (*y)[i * step]);
    });
  }
  return Loop([x, y, wide, sa = strides_for(a, wide), sb = strides_for(b, wide), count, operation](float* to) {
    for (std::int64_t i = 0; i < count; ++i) {
      std::int64_t rest = i, ia = 0, ib = 0;
      for (std::size_t d = wide.size(); d-- > 0; rest /= wide[d]) {
        ia += rest % wide[d] * sa[d];
        ib += rest % wide[d] * sb[d];
      }
      to[i] = operation((*x)[ia], (*y)[ib]);
    }
  });
}

Result<Loop> add(const Site& site) {
  return elementwise(site, [](float x, float y) { return x + y; });
}
Result<Loop> multiply(const Site& site) {
  return elementwise(site, [](float x, float y) { return x * y; });
}

Result<Loop> relu(const Site& site) {
  return Loop([x = site.numbers(0)](float* to) {
    for (std::size_t i = 0; i < x->size(); ++i) to[i] = std::max((*x)[i], 0.0f);
  });
}

template <bool kMax>
Result<Loop> global_pool(const Site& site) {
  const Shape& in = site.shape(0);
  if (in.size() != 4) return Error{"a pool of something that is no image"};
  return Loop([x = site.numbers(0), rows = in[0] * in[1], size = in[2] * in[3]](float* to) {
    for (std::int64_t r = 0; r < rows; ++r) {
      const float* row = x->data() + r * size;
      float value = kMax ? row[0] : 0.0f;
      for (std::int64_t i = 0; i < size; ++i) value = kMax ? std::max(value, row[i]) : value + row[i];
      to[r] = kMax ? value : value / static_cast<float>(size);
    }
  });
}

Result<Loop> resize(const Site& site) {
  const model::Node& node = site.node;
  if (site.inputs() != 3 || site.shape(0).size() != 4 || node.word("mode", "nearest") != "nearest" ||
      node.word("coordinate_transformation_mode", "half_pixel") != "asymmetric" ||
      node.word("nearest_mode", "round_prefer_floor") != "floor")
    return Error{"Resize other than of images to the nearest, asymmetric, by scales"};
  const model::Array* const given = site.graph.constant(node.inputs[2]);
  if (given == nullptr || given->integer || given->values.size() != 4) return Error{"Resize without constant scales"};
  const std::vector<float> scales(given->values.begin(), given->values.end());
  const auto sy = static_cast<std::int64_t>(scales[2]), sx = static_cast<std::int64_t>(scales[3]);
  if (scales[0] != 1.0f || scales[1] != 1.0f || static_cast<float>(sy) != scales[2] ||
      static_cast<float>(sx) != scales[3] || sy < 1 || sx < 1)
    return Error{"Resize by what is no whole number"};
  return Loop([x = site.numbers(0), in = site.shape(0), sy, sx](float* to) {
    const std::int64_t width = sx * in[3];
    for (std::int64_t row = 0; row < in[0] * in[1] * in[2]; ++row) {
      const float* from = x->data() + row * in[3];
      float* first = to + row * sy * width;
      for (std::int64_t i = 0; i < in[3]; ++i) std::fill_n(first + i * sx, sx, from[i]);
      for (std::int64_t again = 1; again < sy; ++again) std::copy_n(first, width, first + again * width);
    }
  });
}

Result<Loop> concat(const Site& site) {
  const Shape& result = site.result();
  const std::int64_t outer = product(result, 0, axis_of(site.node.integer("axis", 0), result));
  std::vector<std::pair<Numbers, std::int64_t>> parts;  // numbers, and how many of them side by side
  for (std::size_t i = 0; i < site.inputs(); ++i)
    parts.emplace_back(site.numbers(i), outer == 0 ? 0 : product(site.shape(i)) / outer);
  return Loop([parts, outer](float* to) {
    for (std::int64_t o = 0; o < outer; ++o)
      for (const auto& [x, length] : parts) to = std::copy_n(x->data() + o * length, length, to);
  });
}

Result<Loop> slice(const Site& site) {
  if (site.inputs() != 4) return Error{"Slice other than with starts, ends and axes"};
  const auto from = site.integers(1), to = site.integers(2), axes = site.integers(3);
  if (!from || !to || !axes || from->size() != 1 || to->size() != 1 || axes->size() != 1)
    return Error{"Slice along several axes"};
  const Shape& in = site.shape(0);
  const std::size_t at = axis_of((*axes)[0], in);
  const std::int64_t first = (*from)[0];
  const std::int64_t begin = std::clamp<std::int64_t>(first < 0 ? first + in[at] : first, 0, in[at]);
  const std::int64_t outer = product(in, 0, at), inner = product(in, at + 1, in.size());
  return Loop([x = site.numbers(0), outer, inner, begin, length = site.result()[at] * inner,
               row = in[at] * inner](float* result) {
    for (std::int64_t o = 0; o < outer; ++o) result = std::copy_n(x->data() + o * row + begin * inner, length, result);
  });
}

Result<Loop> transpose(const Site& site) {
  const Shape &in = site.shape(0), &shape = site.result();
  const Shape order = site.node.integers("perm", {});
  if (order.size() != in.size()) return Error{"Transpose without perm"};
  const Numbers x = site.numbers(0);
  if (order == Shape{0, 2, 1}) {
    return Loop([x, shape](float* to) {
      const std::int64_t rows = shape[1], columns = shape[2];
      for (std::int64_t image = 0; image < shape[0]; ++image) {
        const float* from = x->data() + image * rows * columns;
        for (std::int64_t r = 0; r < rows; ++r)
          for (std::int64_t c = 0; c < columns; ++c) *to++ = from[c * rows + r];
      }
    });
  }
  Shape strides(in.size(), 1), steps(in.size());
  for (std::size_t i = in.size(); i-- > 1;) strides[i - 1] = strides[i] * in[i];
  for (std::size_t i = 0; i < in.size(); ++i) steps[i] = strides[static_cast<std::size_t>(order[i])];
  return Loop([x, shape, steps, count = product(in)](float* to) {
    for (std::int64_t i = 0; i < count; ++i) {
      std::int64_t rest = i, from = 0;
      for (std::size_t d = shape.size(); d-- > 0; rest /= shape[d]) from += rest % shape[d] * steps[d];
      to[i] = (*x)[from];
    }
  });
}

Result<Loop> softmax(const Site& site) {
  const Shape& in = site.shape(0);
  // Up to operator set 12 over everything from the axis on: the same along the last one.
  const std::int64_t axis = site.node.integer("axis", site.graph.operator_set() < 13 ? 1 : -1);
  if (axis_of(axis, in) + 1 != in.size()) return Error{"Softmax not along the last axis"};
  const std::int64_t length = in.back(), rows = length == 0 ? 0 : product(in) / length;
  return Loop([x = site.numbers(0), rows, length](float* to) {
    for (std::int64_t r = 0; r < rows; ++r) {
      const float* row = x->data() + r * length;
      const float most = *std::max_element(row, row + length);
      float sum = 0.0f;
      for (std::int64_t i = 0; i < length; ++i) sum += to[r * length + i] = std::exp(row[i] - most);
      for (std::int64_t i = 0; i < length; ++i) to[r * length + i] /= sum;
    }
  });
}

Result<Loop> matmul(const Site& site) {
  const Shape &a = site.shape(0), &b = site.shape(1);
  if (a.size() != 3 || b.size() != 3 || a[0] != b[0]) return Error{"MatMul other than batched"};
  const Numbers x = site.numbers(0), y = site.numbers(1);
  return Loop([x, y, a, columns = b[2]](float* to) {
    for (std::int64_t row = 0; row < a[0] * a[1]; ++row) {
      float* sum = to + row * columns;
      std::fill_n(sum, columns, 0.0f);
      const float* matrix = y->data() + row / a[1] * a[2] * columns;
      for (std::int64_t k = 0; k < a[2]; ++k) {
        const float factor = (*x)[row * a[2] + k];
        for (std::int64_t c = 0; c < columns; ++c) sum[c] += factor * matrix[k * columns + c];
      }
    }
  });
}

struct Entry {
  std::string_view type;
  Result<Loop> (*make)(const Site& site);
};
constexpr Entry kLoops[] = {
    {"Add", add},         {"Concat", concat},       {"GlobalAveragePool", global_pool<false>},
    {"MatMul", matmul},   {"Mul", multiply},        {"GlobalMaxPool", global_pool<true>},
    {"Relu", relu},       {"Resize", resize},       {"Slice", slice},
    {"Softmax", softmax}, {"Transpose", transpose},
};

}  // namespace

Result<Loop> loop_of(const model::Graph& graph, const model::Node& node,
                     const std::function<Numbers(int slot)>& numbers) {
  const auto* const found =
      std::find_if(std::begin(kLoops), std::end(kLoops), [&](const Entry& entry) { return entry.type == node.type; });
  if (found == std::end(kLoops)) return Error{node.type};
  return found->make({graph, node, numbers});
}

}  // namespace gatefield::perception
