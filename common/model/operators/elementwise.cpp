#include "common/model/operators/elementwise.h"

#include <onnx/onnx_pb.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {
namespace {

template <typename Function>
void each(Call& call, Function&& function) {
  const Array& in = call.input(0);
  Array& out = call.result(in.shape, in.integer);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), function);
}

template <typename Function>
void combine(Call& call, const Array& a, const Array& b, bool integer, const Function& function) {
  const Shape shape = broadcast(a.shape, b.shape);
  Array& out = call.result(shape, integer);
  walk<2>(shape, {spread_strides(a.shape, shape), spread_strides(b.shape, shape)}, {0, 0},
          [&](std::int64_t n, const auto& from) {
            out.values[at(n)] = function(a.values[at(from[0])], b.values[at(from[1])]);
          });
}

template <typename Function>
void both(Call& call, const Function& function) {
  const Array &a = call.input(0), &b = call.input(1);
  combine(call, a, b, a.integer && b.integer, function);
}

template <typename Function>
void over_all(Call& call, const Function& function) {
  Array sofar = call.input(0);
  for (std::size_t i = 1; i < call.in.size(); ++i) {
    combine(call, sofar, call.input(i), sofar.integer && call.input(i).integer, function);
    sofar = *call.out[0];
  }
  call.result(sofar.shape, sofar.integer).values = std::move(sofar.values);
}

}  // namespace

void abs(Call& call) {
  each(call, [](double x) { return std::fabs(x); });
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
void ceil(Call& call) {
  each(call, [](double x) { return std::ceil(x); });
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
void cos(Call& call) {
  each(call, [](double x) { return std::cos(x); });
}
void elu(Call& call) {
  each(call, [alpha = call.number("alpha", 1.0)](double x) { return x < 0.0 ? alpha * std::expm1(x) : x; });
}
void erf(Call& call) {
  each(call, [](double x) { return std::erf(x); });
}
void exp(Call& call) {
  each(call, [](double x) { return std::exp(x); });
}
void floor(Call& call) {
  each(call, [](double x) { return std::floor(x); });
}
void hard_sigmoid(Call& call) {
  each(call, [alpha = call.number("alpha", 0.2), beta = call.number("beta", 0.5)](double x) {
    return std::max(0.0, std::min(1.0, alpha * x + beta));
  });
}
void hard_swish(Call& call) {
  each(call, [](double x) { return x * std::clamp(x / 6.0 + 0.5, 0.0, 1.0); });
}
void identity(Call& call) {
  each(call, [](double x) { return x; });
}
void leaky_relu(Call& call) {
  each(call, [alpha = call.number("alpha", 0.01)](double x) { return x < 0.0 ? alpha * x : x; });
}
void log(Call& call) {
  each(call, [](double x) { return std::log(x); });
}
void neg(Call& call) {
  each(call, [](double x) { return -x; });
}
void reciprocal(Call& call) {
  each(call, [](double x) { return 1.0 / x; });
}
void relu(Call& call) {
  each(call, [](double x) { return x > 0.0 ? x : 0.0; });
}
void sigmoid(Call& call) {
  each(call, [](double x) { return 1.0 / (1.0 + std::exp(-x)); });
}
void sin(Call& call) {
  each(call, [](double x) { return std::sin(x); });
}
void softplus(Call& call) {
  each(call, [](double x) { return x > 30.0 ? x : std::log1p(std::exp(x)); });
}
void sqrt(Call& call) {
  each(call, [](double x) { return std::sqrt(x); });
}
void tanh(Call& call) {
  each(call, [](double x) { return std::tanh(x); });
}

void add(Call& call) {
  both(call, [](double a, double b) { return a + b; });
}
void div(Call& call) {
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
void max(Call& call) {
  over_all(call, [](double a, double b) { return std::max(a, b); });
}
void min(Call& call) {
  over_all(call, [](double a, double b) { return std::min(a, b); });
}
void mul(Call& call) {
  both(call, [](double a, double b) { return a * b; });
}
void pow(Call& call) {
  both(call, [](double a, double b) { return std::pow(a, b); });
}
void prelu(Call& call) {
  both(call, [](double a, double b) { return a < 0.0 ? b * a : a; });
}
void sub(Call& call) {
  both(call, [](double a, double b) { return a - b; });
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

}  // namespace gatefield::model::operators
