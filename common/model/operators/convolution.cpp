#include "common/model/operators/convolution.h"

#include <algorithm>

#include "common/model/onnx_file.h"
#include "common/model/operators/arrays.h"
#include "common/model/operators/window.h"

namespace gatefield::model::operators {

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

}  // namespace gatefield::model::operators
