#include "server/kernels/decoder/cpu_decoder.h"

#include <cassert>
#include <cstddef>

namespace gatefield::kernels {
namespace {

LayerView view_of(const PackedLayer& weights, const PackedLayer& biases) noexcept {
  return {weights.weight.data(),
          biases.bias.data(),
          weights.pairs.data(),
          weights.unit,
          weights.tiles.data(),
          biases.tile_bias.data(),
          static_cast<std::size_t>(weights.inputs),
          static_cast<std::size_t>(weights.outputs)};
}

}  // namespace

bool takes(Layout layout, const model::DecoderWeights& weights) noexcept {
  const std::size_t layers = weights.layers.size() + (weights.kind == model::DecoderKind::kHyper ? 1 : 0);
  return layout == Layout::kFp32 || layers >= (layout == Layout::kInt16 ? 3u : 2u);
}

CpuDecoder::CpuDecoder(const model::DecoderWeights& weights, const DecodeKernel& kernel)
    : PreparedDecoder(weights), kernel_(kernel), inner_(inner().size()) {
  assert(takes(kernel.layout, weights));
  assert(inner_.size() + 1 <= kMaxLayers);
  const bool tiles = kernel_.layout == Layout::kTiles;
  if (!hyper()) {
    pack_weights(point_columns(), &point_columns_);
    if (tiles) pack_tiles(point_columns(), &point_columns_);
  }
  for (std::size_t i = 0; i < inner_.size(); ++i) {
    const model::Dense& layer = inner()[i];
    pack_weights(layer, &inner_[i]);
    pack_bias(layer.bias, &inner_[i]);
    if (kernel_.layout == Layout::kInt16) pack_pairs(layer, &inner_[i]);
    if (tiles && i + 1 < inner_.size()) {
      pack_tiles(layer, &inner_[i]);
      pack_tile_bias(layer.bias, &inner_[i]);
    }
  }
}

void CpuDecoder::lay_out(FoldedDecoder* out) const {
  const bool tiles = kernel_.layout == Layout::kTiles;
  PackedLayer& packed = out->packed;
  if (hyper()) {
    pack_weights(out->first, &packed);
    if (tiles) pack_tiles(out->first, &packed);
  } else {
    packed.inputs = point_columns_.inputs;
    packed.outputs = point_columns_.outputs;
    packed.weight.clear();
    packed.tiles.clear();
  }
  pack_bias(out->first.bias, &packed);
  if (tiles) pack_tile_bias(out->first.bias, &packed);
}

void CpuDecoder::decode(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
                        std::span<const float> z_W, std::span<float> sdf_m) const noexcept {
  DecoderView view;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) view.R_CW[3 * i + j] = folded.R_CW(i, j);
    view.t_CW[i] = folded.t_CW[i];
  }
  view.half_inverse_scale = 0.5f * (hyper() ? 1.0f : static_cast<float>(1.0 / weights().position_scale_m));
  view.max_coordinate = static_cast<float>(kMaxCoordinate_m);
  view.octaves = hyper() ? 0 : static_cast<std::size_t>(weights().encoding_octaves);
  view.layer_count = inner_.size() + 1;
  view.layers[0] = view_of(hyper() ? folded.packed : point_columns_, folded.packed);
  for (std::size_t i = 0; i < inner_.size(); ++i) view.layers[i + 1] = view_of(inner_[i], inner_[i]);
  kernel_.loop(view, x_W.data(), y_W.data(), z_W.data(), sdf_m.data(), sdf_m.size());
}

}  // namespace gatefield::kernels
