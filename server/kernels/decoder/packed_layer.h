#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/model/bundle.h"

namespace gatefield::kernels {

/// What a decoder's layers are laid out for. Everything but its inner layers is single precision everywhere.
enum class Layout {
  kFp32,   ///< single precision throughout
  kInt16,  ///< avx512_int16.cpp: layers between the first and the last in 16-bit fixed point
  kTiles,  ///< tiled-inl.h: all hidden layers in tiles of bf16
};

/// One layer as the processor's decoders read it: outputs filled up to a multiple of kNeuronGroup with zeros, then in
/// groups of four weight[group][input][4], so that the inner loop reads one stream per group.
struct PackedLayer {
  int inputs = 0;
  int outputs = 0;  ///< padded
  std::vector<float> weight;
  std::vector<float> bias;
  /// kInt16, but for the first layer: two inputs' weights as 16-bit multiples of `unit`, the even one in the lower
  /// half, [group of kNeuronGroup][pair of inputs][neuron].
  std::vector<std::uint32_t> pairs;
  float unit = 0.0f;
  /// kTiles, but for the last layer: weights [block of 16 outputs][step of 32 inputs][hi, lo][output][input] in bf16,
  /// and biases filled up.
  std::vector<std::uint32_t> tiles;
  std::vector<float> tile_bias;
};
inline constexpr int kNeuronGroup = 8;

/// Each writes its part of `out` and uses its memory again. pack_weights() comes first: the others need the sizes.
void pack_weights(const model::Dense& layer, PackedLayer* out);
void pack_bias(std::span<const float> bias, PackedLayer* out);
void pack_pairs(const model::Dense& layer, PackedLayer* out);
void pack_tiles(const model::Dense& layer, PackedLayer* out);
void pack_tile_bias(std::span<const float> bias, PackedLayer* out);

}  // namespace gatefield::kernels
