#pragma once

#include <cstddef>
#include <cstdint>

namespace gatefield::kernels {

struct LayerView {
  const float* weight;
  const float* bias;
  const std::uint32_t* pairs;  ///< null unless the machine takes them
  float unit;                  ///< of the pairs
  const std::uint32_t* tiles;  ///< null unless the machine takes them
  const float* tile_bias;
  std::size_t inputs;
  std::size_t outputs;
};

inline constexpr std::size_t kMaxLayers = 16;
inline constexpr std::size_t kMostInputs = 256;  ///< kMaxWidth
/// Largest activation in fixed point, 13 bits: what is left of 31 is for sums of weights.
inline constexpr float kMostActivation = 8191.0f;

/// FoldedDecoder as plain numbers: nothing of the standard library or Eigen gets compiled for an instruction set.
struct DecoderView {
  float R_CW[9];  ///< row-major
  float t_CW[3];
  float half_inverse_scale;
  float max_coordinate;
  std::size_t octaves;
  std::size_t layer_count;
  LayerView layers[kMaxLayers];
};

/// avx512_int16.cpp; only for machines that have AVX512_VNNI. @pre layer_count >= 3, every layer but the first has
/// `pairs`
void decode_avx512_int16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                         std::size_t count) noexcept;

/// amx_bf16.cpp; only for machines that have AMX. @pre layer_count >= 2, every layer but the last has `tiles`
void decode_amx_bf16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                     std::size_t count) noexcept;

struct FoldedDecoder;
/// The decoder's numbers, which must outlive it.
DecoderView view_of(const FoldedDecoder& decoder) noexcept;

}  // namespace gatefield::kernels
