#include "common/model/operators/window.h"

#include "common/model/onnx_file.h"

namespace gatefield::model::operators {

Window::Window(Call& call, const Shape& in, const Shape& kernel_shape) {
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

}  // namespace gatefield::model::operators
