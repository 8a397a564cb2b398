#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "server/kernels/decoder/decoder.h"

/// Decoders and points to try kernels with.
namespace gatefield::kernels {

using model::DecoderKind;
using model::DecoderWeights;
using model::Dense;

/// He-scaled, so that values keep their size from layer to layer as in a trained network.
inline Dense random_dense(int inputs, int outputs, Random& random, double gain = 1.0) {
  Dense layer{inputs, outputs, {}, {}};
  const double sigma = gain * std::sqrt(2.0 / inputs);
  for (int i = 0; i < inputs * outputs; ++i) layer.weight.push_back(static_cast<float>(sigma * random.normal()));
  for (int i = 0; i < outputs; ++i) layer.bias.push_back(static_cast<float>(0.1 * random.normal()));
  return layer;
}

inline DecoderWeights random_weights(DecoderKind kind, const std::vector<int>& hidden, int octaves,
                                     std::uint64_t seed) {
  Random random(seed);
  DecoderWeights weights;
  weights.kind = kind;
  weights.position_scale_m = 4.0;
  int inputs = 0;
  std::size_t first_hidden = 0;
  if (kind == DecoderKind::kHyper) {
    weights.latent_size = 3 + 29;
    weights.generator = random_dense(29, 4 * hidden[0], random);
    inputs = hidden[0];
    first_hidden = 1;
  } else {
    weights.latent_size = 32;
    weights.encoding_octaves = octaves;
    inputs = 32 + 3 + 6 * octaves;
  }
  for (std::size_t i = first_hidden; i < hidden.size(); ++i) {
    weights.layers.push_back(random_dense(inputs, hidden[i], random));
    inputs = hidden[i];
  }
  weights.layers.push_back(random_dense(inputs, 1, random, 0.5));
  return weights;
}

inline std::vector<float> random_latent(int size, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> latent;
  for (int i = 0; i < size; ++i) latent.push_back(static_cast<float>(0.5 * random.normal()));
  return latent;
}

struct Points {
  std::vector<float> x, y, z;
  explicit Points(std::size_t count, std::uint64_t seed = 1, double reach_m = 4.0) {
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
      x.push_back(static_cast<float>(random.uniform(-reach_m, reach_m)));
      y.push_back(static_cast<float>(random.uniform(-reach_m, reach_m)));
      z.push_back(static_cast<float>(random.uniform(0.0, reach_m)));
    }
  }
};

/// Bytes that a copy takes beside the weights that all share.
inline std::size_t size_of(const FoldedDecoder& folded) {
  const PackedLayer& packed = folded.packed;
  return sizeof folded +
         sizeof(float) * (folded.first.weight.size() + folded.first.bias.size() + packed.weight.size() +
                          packed.bias.size() + packed.tile_bias.size()) +
         sizeof(std::uint32_t) * (packed.pairs.size() + packed.tiles.size());
}

struct Shape {
  DecoderKind kind;
  std::vector<int> hidden;
  int octaves;
};

inline const Shape kShapes[] = {
    {DecoderKind::kHyper, {64, 64}, 0},        {DecoderKind::kHyper, {16}, 0},
    {DecoderKind::kHyper, {32, 48, 24}, 0},    {DecoderKind::kHyper, {17, 33}, 0},
    {DecoderKind::kHyper, {128, 128}, 0},      {DecoderKind::kHyper, {256, 256}, 0},
    {DecoderKind::kConcatenated, {64, 64}, 5}, {DecoderKind::kConcatenated, {256, 256, 256}, 6},
    {DecoderKind::kConcatenated, {30}, 0},     {DecoderKind::kConcatenated, {100, 50, 25, 12}, 3},
    {DecoderKind::kConcatenated, {}, 4}};

}  // namespace gatefield::kernels
