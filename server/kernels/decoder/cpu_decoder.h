#pragma once

#include <vector>

#include "server/kernels/decoder/decoder.h"
#include "server/kernels/decoder/view.h"

namespace gatefield::kernels {

/// A loop over points and the layout that it reads.
struct DecodeKernel {
  Layout layout;
  DecodeLoop* loop;
};

/// Whether a decoder has the layers that a layout is for: with one hidden layer there is nothing between the first and
/// the last, with none there is nothing to multiply in tiles.
bool takes(Layout layout, const model::DecoderWeights& weights) noexcept;

/// A decoder for the processor: layers packed as a kernel reads them.
class CpuDecoder final : public PreparedDecoder {
 public:
  /// @pre takes(kernel.layout, weights)
  CpuDecoder(const model::DecoderWeights& weights, const DecodeKernel& kernel);
  void decode(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
              std::span<const float> z_W, std::span<float> sdf_m) const noexcept override;
  void lay_out(FoldedDecoder* out) const override;

 private:
  DecodeKernel kernel_;
  PackedLayer point_columns_;       ///< kConcatenated: weights of the first layer, without its bias
  std::vector<PackedLayer> inner_;  ///< those behind it
};

}  // namespace gatefield::kernels
