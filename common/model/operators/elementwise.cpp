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
void map(Call& call, const Function& function) {
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

void cast_to(Call& call, bool integer, bool boolean) {
  const Array& in = call.input(0);
  Array& out = call.result(in.shape, integer);
  std::transform(in.values.begin(), in.values.end(), out.values.begin(), [&](double x) {
    if (boolean) return x != 0.0 ? 1.0 : 0.0;
    return integer ? static_cast<double>(to_integer(x)) : x;
  });
}

}  // namespace

void each(Call& call) { map(call, call.node.known->unary); }
void both(Call& call) {
  const Array &a = call.input(0), &b = call.input(1);
  combine(call, a, b, a.integer && b.integer, call.node.known->binary);
}
void over_all(Call& call) {
  Array sofar = call.input(0);
  for (std::size_t i = 1; i < call.in.size(); ++i) {
    combine(call, sofar, call.input(i), sofar.integer && call.input(i).integer, call.node.known->binary);
    sofar = *call.out[0];
  }
  call.result(sofar.shape, sofar.integer).values = std::move(sofar.values);
}

void cast(Call& call) {
  const std::int64_t to = call.integer("to", 0);
  const bool boolean = to == onnx::TensorProto::BOOL;
  const bool integer = boolean || to == onnx::TensorProto::INT32 || to == onnx::TensorProto::INT64;
  expect(integer || to == onnx::TensorProto::FLOAT,
         "casts to ONNX data type " + std::to_string(to) + ", expected 1 (float), 6 (int32), 7 (int64) or 9 (bool)");
  cast_to(call, integer, boolean);
}
void cast_like(Call& call) { cast_to(call, call.input(1).integer, false); }
void clip(Call& call) {
  const auto bound = [&](std::size_t i, double otherwise) {
    if (!call.has(i)) return otherwise;
    expect(call.input(i).values.size() == 1,
           "a bound of shape " + shape_text(call.input(i).shape) + ", expected one number");
    return call.input(i).values[0];
  };
  const double low = bound(1, -std::numeric_limits<double>::infinity());
  const double high = bound(2, std::numeric_limits<double>::infinity());
  map(call, [&](double x) { return std::min(std::max(x, low), high); });
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
void elu(Call& call) {
  map(call, [alpha = call.number("alpha", 1.0)](double x) { return x < 0.0 ? alpha * std::expm1(x) : x; });
}
void equal(Call& call) {
  combine(call, call.input(0), call.input(1), true, [](double x, double y) { return x == y ? 1.0 : 0.0; });
}
void hard_sigmoid(Call& call) {
  map(call, [alpha = call.number("alpha", 0.2), beta = call.number("beta", 0.5)](double x) {
    return std::max(0.0, std::min(1.0, alpha * x + beta));
  });
}
void leaky_relu(Call& call) {
  map(call, [alpha = call.number("alpha", 0.01)](double x) { return x < 0.0 ? alpha * x : x; });
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
