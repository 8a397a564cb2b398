#include "common/model/operators/pooling.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"
#include "common/model/operators/window.h"

namespace gatefield::model::operators {
namespace {

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

}  // namespace

void average_pool(Call& call) { pool<false>(call); }
void max_pool(Call& call) { pool<true>(call); }
void global_average_pool(Call& call) { global_pool<false>(call); }
void global_max_pool(Call& call) { global_pool<true>(call); }

}  // namespace gatefield::model::operators
