#pragma once

#include <cstddef>
#include <cstdint>

namespace gatefield::kernels {

struct LayerView {
  const float* weight;
  const float* bias;
  const std::uint32_t* pairs;  ///< null unless the machine takes bf16
  std::size_t inputs;
  std::size_t outputs;
};

inline constexpr std::size_t kMaxLayers = 16;
inline constexpr std::size_t kMostInputs = 256;  ///< kMaxWidth

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

/// avx512_bf16.cpp; only for machines that have it. @pre layer_count >= 3, every layer but the first has `pairs`
void decode_avx512_bf16(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf,
                        std::size_t count) noexcept;

}  // namespace gatefield::kernels
