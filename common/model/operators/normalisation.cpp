#include "common/model/operators/normalisation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {
namespace {

/// Numbers per channel of `in`.
const std::vector<double>& per_channel(Call& call, std::size_t i) {
  const Array& in = call.input(0);
  expect(in.shape.size() >= 2 && call.input(i).shape == Shape({in.shape[1]}),
         "has an input " + std::to_string(i) + " of shape " + shape_text(call.input(i).shape) + " for " +
             shape_text(in.shape));
  return call.input(i).values;
}

}  // namespace

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

}  // namespace gatefield::model::operators
