#include "common/model/operators/matrix.h"

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {
namespace {

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

}  // namespace

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

}  // namespace gatefield::model::operators
