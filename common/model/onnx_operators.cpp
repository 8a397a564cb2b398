#include "common/model/onnx_operators.h"

#include <algorithm>
#include <cmath>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"
#include "common/model/operators/convolution.h"
#include "common/model/operators/elementwise.h"
#include "common/model/operators/matrix.h"
#include "common/model/operators/normalisation.h"
#include "common/model/operators/pooling.h"
#include "common/model/operators/rearrangement.h"
#include "common/model/operators/reduction.h"
#include "common/model/operators/resizing.h"
#include "common/model/operators/shape.h"

namespace gatefield::model {
namespace {

using operators::at;
using operators::expect;
using operators::kFar;

constexpr std::size_t kMaxRank = 8;

constexpr std::string_view kNone = " ";
constexpr std::string_view kReduced = " axes keepdims noop_with_empty_axes ";

/// One line each: type, what it does, fewest and most inputs, most outputs, attributes.
constexpr Operator kOperators[] = {
    {"Abs", operators::each, 1, 1, 1, kNone, [](double x) { return std::fabs(x); }},
    {"Add", operators::both, 2, 2, 1, kNone, nullptr, [](double a, double b) { return a + b; }},
    {"AveragePool", operators::average_pool, 1, 1, 1,
     " kernel_shape strides pads auto_pad ceil_mode count_include_pad dilations "},
    {"BatchNormalization", operators::batch_normalization, 5, 5, 1, " epsilon momentum training_mode "},
    {"Cast", operators::cast, 1, 1, 1, " to saturate "},
    {"CastLike", operators::cast_like, 2, 2, 1, " saturate "},
    {"Ceil", operators::each, 1, 1, 1, kNone, [](double x) { return std::ceil(x); }},
    {"Clip", operators::clip, 1, 3, 1, kNone},
    {"Concat", operators::concat, 1, 256, 1, " axis "},
    {"Constant", nullptr, 0, 0, 1, " value value_float value_floats value_int value_ints "},
    {"ConstantOfShape", operators::constant_of_shape, 1, 1, 1, " value "},
    {"Conv", operators::conv, 2, 3, 1, " auto_pad dilations group kernel_shape pads strides "},
    {"Cos", operators::each, 1, 1, 1, kNone, [](double x) { return std::cos(x); }},
    {"Div", operators::div, 2, 2, 1, kNone},
    {"Elu", operators::elu, 1, 1, 1, " alpha "},
    {"Equal", operators::equal, 2, 2, 1, kNone},
    {"Erf", operators::each, 1, 1, 1, kNone, [](double x) { return std::erf(x); }},
    {"Exp", operators::each, 1, 1, 1, kNone, [](double x) { return std::exp(x); }},
    {"Expand", operators::expand, 2, 2, 1, kNone},
    {"Flatten", operators::flatten, 1, 1, 1, " axis "},
    {"Floor", operators::each, 1, 1, 1, kNone, [](double x) { return std::floor(x); }},
    {"Gather", operators::gather, 2, 2, 1, " axis "},
    {"Gemm", operators::gemm, 2, 3, 1, " alpha beta transA transB "},
    {"GlobalAveragePool", operators::global_average_pool, 1, 1, 1, kNone},
    {"GlobalMaxPool", operators::global_max_pool, 1, 1, 1, kNone},
    {"HardSigmoid", operators::hard_sigmoid, 1, 1, 1, " alpha beta "},
    {"HardSwish", operators::each, 1, 1, 1, kNone, [](double x) { return x * std::clamp(x / 6.0 + 0.5, 0.0, 1.0); }},
    {"Identity", operators::each, 1, 1, 1, kNone, [](double x) { return x; }},
    {"InstanceNormalization", operators::instance_normalization, 3, 3, 1, " epsilon "},
    {"LeakyRelu", operators::leaky_relu, 1, 1, 1, " alpha "},
    {"Log", operators::each, 1, 1, 1, kNone, [](double x) { return std::log(x); }},
    {"MatMul", operators::matmul, 2, 2, 1, kNone},
    {"Max", operators::over_all, 1, 16, 1, kNone, nullptr, [](double a, double b) { return std::max(a, b); }},
    {"MaxPool", operators::max_pool, 1, 1, 1, " kernel_shape strides pads auto_pad ceil_mode dilations storage_order "},
    {"Min", operators::over_all, 1, 16, 1, kNone, nullptr, [](double a, double b) { return std::min(a, b); }},
    {"Mul", operators::both, 2, 2, 1, kNone, nullptr, [](double a, double b) { return a * b; }},
    {"Neg", operators::each, 1, 1, 1, kNone, [](double x) { return -x; }},
    {"PRelu", operators::both, 2, 2, 1, kNone, nullptr, [](double a, double b) { return a < 0.0 ? b * a : a; }},
    {"Pad", operators::pad, 2, 4, 1, " mode "},
    {"Pow", operators::both, 2, 2, 1, kNone, nullptr, [](double a, double b) { return std::pow(a, b); }},
    {"Reciprocal", operators::each, 1, 1, 1, kNone, [](double x) { return 1.0 / x; }},
    {"ReduceL2", operators::reduce_l2, 1, 2, 1, kReduced},
    {"ReduceMax", operators::reduce_max, 1, 2, 1, kReduced},
    {"ReduceMean", operators::reduce_mean, 1, 2, 1, kReduced},
    {"ReduceMin", operators::reduce_min, 1, 2, 1, kReduced},
    {"ReduceProd", operators::reduce_prod, 1, 2, 1, kReduced},
    {"ReduceSum", operators::reduce_sum, 1, 2, 1, kReduced},
    {"Relu", operators::each, 1, 1, 1, kNone, [](double x) { return x > 0.0 ? x : 0.0; }},
    {"Reshape", operators::reshape, 2, 2, 1, " allowzero "},
    {"Resize", operators::resize, 2, 4, 1,
     " antialias coordinate_transformation_mode cubic_coeff_a exclude_outside keep_aspect_ratio_policy mode "
     "nearest_mode "},
    {"Shape", operators::shape, 1, 1, 1, " start end "},
    {"Sigmoid", operators::each, 1, 1, 1, kNone, [](double x) { return 1.0 / (1.0 + std::exp(-x)); }},
    {"Sin", operators::each, 1, 1, 1, kNone, [](double x) { return std::sin(x); }},
    {"Slice", operators::slice, 3, 5, 1, kNone},
    {"Softmax", operators::softmax, 1, 1, 1, " axis "},
    {"Softplus", operators::each, 1, 1, 1, kNone, [](double x) { return x > 30.0 ? x : std::log1p(std::exp(x)); }},
    {"Split", operators::split, 1, 2, 64, " axis split num_outputs "},
    {"Sqrt", operators::each, 1, 1, 1, kNone, [](double x) { return std::sqrt(x); }},
    {"Squeeze", operators::squeeze, 1, 2, 1, " axes "},
    {"Sub", operators::both, 2, 2, 1, kNone, nullptr, [](double a, double b) { return a - b; }},
    {"Tanh", operators::each, 1, 1, 1, kNone, [](double x) { return std::tanh(x); }},
    {"Tile", operators::tile, 2, 2, 1, kNone},
    {"Transpose", operators::transpose, 1, 1, 1, " perm "},
    {"Unsqueeze", operators::unsqueeze, 1, 2, 1, " axes "},
    {"Where", operators::where, 3, 3, 1, kNone},
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
  const std::int64_t count = operators::product(shape);
  left.numbers -= count;
  out[i] = std::make_unique<Array>(Array{shape, std::vector<double>(at(count), 0.0), integer});
  return *out[i];
}

void Call::spend(double multiply_adds) {
  expect(multiply_adds <= static_cast<double>(left.multiply_adds), "takes more multiplications than are allowed");
  left.multiply_adds -= static_cast<std::int64_t>(multiply_adds);
}

}  // namespace gatefield::model
