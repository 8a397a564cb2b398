#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "server/kernels/decoder/decoder.h"
#include "server/kernels/decoder/tiled-inl.h"
#include "server/kernels/decoder/view.h"
#include "server/kernels/isa.h"

namespace gatefield::kernels {
namespace {

std::size_t at(int row, int columns, int column) noexcept {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

void resize(model::Dense* layer, int inputs, int outputs) {
  layer->inputs = inputs;
  layer->outputs = outputs;
  layer->weight.resize(at(outputs, inputs, 0));
  layer->bias.resize(static_cast<std::size_t>(outputs));
}

/// Concatenated: the columns of z go into the bias, those of the encoded point stay.
void fold_columns(const model::Dense& full, std::span<const float> z, model::Dense* out) {
  const int latent = static_cast<int>(z.size());
  resize(out, full.inputs - latent, full.outputs);
  for (int i = 0; i < full.outputs; ++i) {
    double bias = full.bias[static_cast<std::size_t>(i)];
    for (int j = 0; j < latent; ++j)
      bias += double{full.weight[at(i, full.inputs, j)]} * z[static_cast<std::size_t>(j)];
    out->bias[static_cast<std::size_t>(i)] = static_cast<float>(bias);
    for (int j = 0; j < out->inputs; ++j)
      out->weight[at(i, out->inputs, j)] = full.weight[at(i, full.inputs, latent + j)];
  }
}

/// Hyper: z generates the first layer, W1 [h][3] (which takes 1 / S in) and then b1 [h].
void generate(const model::Dense& generator, std::span<const float> z, double scale_m, model::Dense* out) {
  const int hidden = generator.outputs / 4;
  resize(out, 3, hidden);
  for (int i = 0; i < generator.outputs; ++i) {
    double value = generator.bias[static_cast<std::size_t>(i)];
    for (int j = 0; j < generator.inputs; ++j) {
      value += double{generator.weight[at(i, generator.inputs, j)]} * z[static_cast<std::size_t>(j)];
    }
    if (i < 3 * hidden) {
      out->weight[static_cast<std::size_t>(i)] = static_cast<float>(value / scale_m);
    } else {
      out->bias[static_cast<std::size_t>(i - 3 * hidden)] = static_cast<float>(value);
    }
  }
}

void pack(const model::Dense& layer, PackedLayer* out) {
  const int padded = (layer.outputs + kNeuronGroup - 1) / kNeuronGroup * kNeuronGroup;
  out->inputs = layer.inputs;
  out->outputs = padded;
  out->weight.assign(at(padded, layer.inputs, 0), 0.0f);
  out->bias.assign(static_cast<std::size_t>(padded), 0.0f);
  for (int i = 0; i < layer.outputs; ++i) {
    out->bias[static_cast<std::size_t>(i)] = layer.bias[static_cast<std::size_t>(i)];
    float* group = out->weight.data() + at(i / 4 * 4, layer.inputs, 0);
    for (int j = 0; j < layer.inputs; ++j) group[at(j, 4, i % 4)] = layer.weight[at(i, layer.inputs, j)];
  }
}

/// Weights in fixed point. The unit is the least with which no sum over a neuron's inputs can leave 32 bits, whatever
/// activations up to kMostActivation are, and no weight 16.
void pack_pairs(const model::Dense& layer, PackedLayer* out) {
  double most = 0.0, most_sum = 0.0;
  for (int i = 0; i < layer.outputs; ++i) {
    double sum = 0.0;
    for (int j = 0; j < layer.inputs; ++j) {
      const double size = std::abs(double{layer.weight[at(i, layer.inputs, j)]});
      most = std::max(most, size);
      sum += size;
    }
    most_sum = std::max(most_sum, sum);
  }
  // Rounding adds half a unit to each weight at most.
  const double sum_limit = 2147483647.0 / double{kMostActivation} - 0.5 * layer.inputs;
  const double unit = std::max({most / 32767.0, most_sum / sum_limit, 1e-30});
  out->unit = static_cast<float>(unit);
  const int pairs = (layer.inputs + 1) / 2;
  out->pairs.assign(at(out->outputs, pairs, 0), 0u);
  for (int i = 0; i < layer.outputs; ++i) {
    std::uint32_t* group = out->pairs.data() + at(i / kNeuronGroup * kNeuronGroup, pairs, 0);
    for (int j = 0; j < layer.inputs; ++j) {
      const auto value = static_cast<std::int16_t>(std::lrint(double{layer.weight[at(i, layer.inputs, j)]} / unit));
      group[at(j / 2, kNeuronGroup, i % kNeuronGroup)] |= std::uint32_t{static_cast<std::uint16_t>(value)}
                                                          << (j % 2 * 16);
    }
  }
}

/// Upper half of a float, rounded to nearest, ties to even; `rest` is what that leaves.
std::uint32_t bf16(float value, float* rest) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t upper = (bits + 0x7fffu + (bits >> 16 & 1u)) >> 16;
  *rest = value - std::bit_cast<float>(upper << 16);
  return upper;
}

void pack_tiles(const model::Dense& layer, PackedLayer* out) {
  const auto inputs = static_cast<std::size_t>(layer.inputs), outputs = static_cast<std::size_t>(layer.outputs);
  const std::size_t steps = tiled::tiles_for(inputs, tiled::kTileInputs);
  const std::size_t blocks = tiled::tiles_for(static_cast<std::size_t>(out->outputs), tiled::kTile);
  out->tiles.assign(blocks * steps * 2 * tiled::kTileWords, 0u);
  out->tile_bias.assign(blocks * tiled::kTile, 0.0f);
  std::copy(layer.bias.begin(), layer.bias.end(), out->tile_bias.begin());
  for (std::size_t i = 0; i < outputs; ++i) {
    for (std::size_t j = 0; j < inputs; ++j) {
      std::uint32_t* hi = out->tiles.data() +
                          (i / tiled::kTile * steps + j / tiled::kTileInputs) * 2 * tiled::kTileWords +
                          i % tiled::kTile * tiled::kTile + j % tiled::kTileInputs / 2;
      float rest = 0.0f, lost = 0.0f;
      hi[0] |= bf16(layer.weight[i * inputs + j], &rest) << (j % 2 * 16);
      hi[tiled::kTileWords] |= bf16(rest, &lost) << (j % 2 * 16);
    }
  }
}

}  // namespace

void lay_out_tiles(FoldedDecoder* decoder) {
  for (std::size_t i = 0; i + 1 < decoder->layers.size(); ++i) pack_tiles(decoder->layers[i], &decoder->packed[i]);
}

DecoderView view_of(const FoldedDecoder& decoder) noexcept {
  DecoderView view;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) view.R_CW[3 * i + j] = decoder.R_CW(i, j);
    view.t_CW[i] = decoder.t_CW[i];
  }
  view.half_inverse_scale = 0.5f * decoder.inverse_scale;
  view.max_coordinate = static_cast<float>(kMaxCoordinate_m);
  view.octaves = static_cast<std::size_t>(decoder.encoding_octaves);
  view.layer_count = decoder.packed.size();
  assert(view.layer_count >= 1 && view.layer_count <= kMaxLayers);
  for (std::size_t i = 0; i < decoder.packed.size(); ++i) {
    const PackedLayer& layer = decoder.packed[i];
    view.layers[i] = {layer.weight.data(),
                      layer.bias.data(),
                      layer.pairs.data(),
                      layer.unit,
                      layer.tiles.data(),
                      layer.tile_bias.data(),
                      static_cast<std::size_t>(layer.inputs),
                      static_cast<std::size_t>(layer.outputs)};
  }
  return view;
}

void fold(const model::DecoderWeights& weights, std::span<const float> latent, const Eigen::Isometry3d& X_WC,
          FoldedDecoder* out) {
  assert(static_cast<int>(latent.size()) == weights.latent_size);
  const Eigen::Isometry3d X_CW = X_WC.inverse();
  Eigen::Vector3d t_CW = X_CW.translation();
  if (weights.kind == model::DecoderKind::kHyper) {
    out->encoding_octaves = 0;
    out->inverse_scale = 1.0f;
    out->layers.resize(weights.layers.size() + 1);
    t_CW -= Eigen::Vector3d(latent[0], latent[1], latent[2]);
    generate(weights.generator, latent.subspan(3), weights.position_scale_m, &out->layers[0]);
    std::copy(weights.layers.begin(), weights.layers.end(), out->layers.begin() + 1);
  } else {
    out->encoding_octaves = weights.encoding_octaves;
    out->inverse_scale = static_cast<float>(1.0 / weights.position_scale_m);
    out->layers.resize(weights.layers.size());
    fold_columns(weights.layers[0], latent, &out->layers[0]);
    std::copy(weights.layers.begin() + 1, weights.layers.end(), out->layers.begin() + 1);
  }
  out->R_CW = X_CW.linear().cast<float>();
  out->t_CW = t_CW.cast<float>();
  out->packed.resize(out->layers.size());
  for (std::size_t i = 0; i < out->layers.size(); ++i) {
    pack(out->layers[i], &out->packed[i]);
    if (i > 0 && available(Arithmetic::kInt16)) pack_pairs(out->layers[i], &out->packed[i]);
  }
  if (available(Arithmetic::kTiles)) lay_out_tiles(out);
}

}  // namespace gatefield::kernels
