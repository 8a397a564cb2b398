#pragma once

#include "common/model/operators/arrays.h"

namespace gatefield::model::operators {

/// Kernel, steps and edges of a convolution or pooling over two dimensions (rows, columns): output o of dimension i has
/// its sample k at from(i, o) + k dilation[i] of the input, where size[i] outputs are
///   size = (in + before + after - (kernel - 1) dilation - 1) / stride + 1.
struct Window {
  std::int64_t kernel[2], stride[2], dilation[2];
  std::int64_t before[2];  ///< padding before the first sample
  std::int64_t size[2];    ///< of the output

  /// @param in            shape of the input, [batch, channels, rows, columns]
  /// @param kernel_shape  rows and columns of the kernel
  /// Refuses what isn't so, a kernel larger than the padded input, automatic padding and ceil_mode.
  Window(Call& call, const Shape& in, const Shape& kernel_shape);

  /// Where the window of output `o` begins, along dimension i.
  std::int64_t from(std::size_t i, std::int64_t o) const { return o * stride[i] - before[i]; }
};

}  // namespace gatefield::model::operators
