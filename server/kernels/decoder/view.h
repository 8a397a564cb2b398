#pragma once

#include <cstddef>
#include <cstdint>

namespace gatefield::kernels {

/// What the processor's decoding loops read, as plain numbers: nothing of the standard library or Eigen gets compiled
/// for an instruction set. The layouts are PackedLayer's.
struct LayerView {
  const float* weight;
  const float* bias;
  const std::uint32_t* pairs;  ///< Layout::kInt16
  float unit;                  ///< of the pairs
  const std::uint32_t* tiles;  ///< Layout::kTiles
  const float* tile_bias;
  std::size_t inputs;
  std::size_t outputs;
};

inline constexpr std::size_t kMaxLayers = 16;
/// Inputs and outputs of any layer after folding; model::Bundle checks it.
inline constexpr std::size_t kMaxWidth = 256;
/// Largest activation in fixed point, 13 bits: what is left of 31 is for sums of weights.
inline constexpr float kMaxActivation = 8191.0f;

struct DecoderView {
  float R_CW[9];  ///< row-major
  float t_CW[3];
  float half_inverse_scale;
  float max_coordinate;
  std::size_t octaves;
  std::size_t layer_count;
  LayerView layers[kMaxLayers];
};

/// sdf[i] = s at (x_W, y_W, z_W)[i], i in [0, count). Scratch is on the stack.
using DecodeLoop = void(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                        std::size_t count);

/// simd.cpp, for a Highway target that this build has; reads Layout::kFp32.
DecodeLoop* decode_loop(std::int64_t target) noexcept;
/// avx512_int16.cpp; only for machines that have AVX512_VNNI. @pre layer_count >= 3; every layer but the first has
/// `pairs`
DecodeLoop decode_avx512_int16;
/// amx_bf16.cpp; only for machines that have AMX. @pre layer_count >= 2; every layer but the last has `tiles`
DecodeLoop decode_amx_bf16;

}  // namespace gatefield::kernels
