#include "server/kernels/decoder/packed_layer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "server/kernels/decoder/tiled-inl.h"
#include "server/kernels/decoder/view.h"

namespace gatefield::kernels {
namespace {

std::size_t at(int row, int columns, int column) noexcept {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// Upper half of a float, rounded to nearest, ties to even; `rest` is what that leaves.
std::uint32_t bf16(float value, float* rest) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t upper = (bits + 0x7fffu + (bits >> 16 & 1u)) >> 16;
  *rest = value - std::bit_cast<float>(upper << 16);
  return upper;
}

}  // namespace

void pack_weights(const model::Dense& layer, PackedLayer* out) {
  const int padded = (layer.outputs + kNeuronGroup - 1) / kNeuronGroup * kNeuronGroup;
  out->inputs = layer.inputs;
  out->outputs = padded;
  out->weight.assign(at(padded, layer.inputs, 0), 0.0f);
  for (int i = 0; i < layer.outputs; ++i) {
    float* group = out->weight.data() + at(i / 4 * 4, layer.inputs, 0);
    for (int j = 0; j < layer.inputs; ++j) group[at(j, 4, i % 4)] = layer.weight[at(i, layer.inputs, j)];
  }
}

void pack_bias(std::span<const float> bias, PackedLayer* out) {
  out->bias.assign(static_cast<std::size_t>(out->outputs), 0.0f);
  std::copy(bias.begin(), bias.end(), out->bias.begin());
}

/// Weights in fixed point. The unit is the least with which no sum over a neuron's inputs can leave 32 bits, whatever
/// activations up to kMaxActivation are, and no weight 16.
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
  const double sum_limit = 2147483647.0 / double{kMaxActivation} - 0.5 * layer.inputs;
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

void pack_tiles(const model::Dense& layer, PackedLayer* out) {
  const auto inputs = static_cast<std::size_t>(layer.inputs), outputs = static_cast<std::size_t>(layer.outputs);
  const std::size_t steps = tiled::tiles_for(inputs, tiled::kTileInputs);
  const std::size_t blocks = tiled::tiles_for(static_cast<std::size_t>(out->outputs), tiled::kTile);
  out->tiles.assign(blocks * steps * 2 * tiled::kTileWords, 0u);
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

void pack_tile_bias(std::span<const float> bias, PackedLayer* out) {
  const std::size_t blocks = tiled::tiles_for(static_cast<std::size_t>(out->outputs), tiled::kTile);
  out->tile_bias.assign(blocks * tiled::kTile, 0.0f);
  std::copy(bias.begin(), bias.end(), out->tile_bias.begin());
}

}  // namespace gatefield::kernels
