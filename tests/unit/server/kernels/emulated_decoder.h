#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "server/kernels/decoder/blocks-inl.h"
#include "server/kernels/decoder/cpu_decoder.h"
#include "server/kernels/decoder/tiled-inl.h"
#include "tests/unit/server/kernels/emulated_tiles.h"

// Functions that call a kernel's inline code have to be compiled for the same instructions.
HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {

/// As amx_bf16.cpp, but for tiles and encoding.
struct EmulatedBlock {
  template <std::size_t kP>
  static void Run(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf) {
    alignas(64) float encoded[(kMaxWidth + tiled::kTileInputs) * kP * 16];
    alignas(64) float s[kP * 16];
    for (float& value : encoded) value = std::nanf("");  // what isn't an input must not matter
    for (std::size_t i = 0; i < kP * 16; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float* R = net.R_CW + 3 * axis;
        const double c = double{net.t_CW[axis]} + double{R[0]} * x_W[i] + double{R[1]} * y_W[i] + double{R[2]} * z_W[i];
        encoded[axis * kP * 16 + i] = static_cast<float>(c);
        for (std::size_t octave = 0; octave < net.octaves; ++octave) {
          const double angle = 2.0 * std::numbers::pi * std::exp2(double(octave)) * double{net.half_inverse_scale} * c;
          encoded[(3 + 6 * octave + axis) * kP * 16 + i] = static_cast<float>(std::sin(angle));
          encoded[(6 + 6 * octave + axis) * kP * 16 + i] = static_cast<float>(std::cos(angle));
        }
      }
    }
    tiled::Run<EmulatedTiles, kP>(net, encoded, s);
    std::copy_n(s, kP * 16, sdf);
  }
};

inline void decode_with_emulated_tiles(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W,
                                       float* sdf, std::size_t count) {
  EmulatedTiles::mistakes = 0;
  EmulatedTiles::Configure();
  HWY_NAMESPACE::InBlocks<EmulatedBlock, 2, 16>(net, x_W, y_W, z_W, sdf, count);
  EmulatedTiles::Release();
  EXPECT_EQ(EmulatedTiles::mistakes, 0);
}

/// What the back end avx3_amx prepares, for any machine; values agree but for the last bits of the encoding.
inline std::shared_ptr<const PreparedDecoder> prepare_emulated(const model::DecoderWeights& weights) {
  return std::make_shared<CpuDecoder>(weights, DecodeKernel{Layout::kTiles, decode_with_emulated_tiles});
}

}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();
