#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "server/kernels/decoder/blocks-inl.h"
#include "server/kernels/decoder/decoder.h"
#include "server/kernels/decoder/tiled-inl.h"
#include "tests/unit/server/kernels/emulated_tiles.h"

// Functions that call a kernel's inline code have to be compiled for the same instructions.
HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {

/// As amx_bf16.cpp, but for tiles and encoding.
struct EmulatedBlock {
  template <std::size_t kP>
  static void Run(const DecoderView& net, const float* x_W, const float* y_W, const float* z_W, float* sdf) {
    alignas(64) float encoded[(kMostInputs + tiled::kTileInputs) * kP * 16];
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

/// What decode() gives on a machine with AMX, but for the last bits of the encoding.
inline void decode_emulated(const FoldedDecoder& folded, std::span<const float> x_W, std::span<const float> y_W,
                            std::span<const float> z_W, std::vector<float>* sdf) {
  FoldedDecoder with_tiles = folded;
  lay_out_tiles(&with_tiles);
  EmulatedTiles::mistakes = 0;
  EmulatedTiles::Configure();
  HWY_NAMESPACE::InBlocks<EmulatedBlock, 2, 16>(view_of(with_tiles), x_W.data(), y_W.data(), z_W.data(), sdf->data(),
                                                x_W.size());
  EmulatedTiles::Release();
  EXPECT_EQ(EmulatedTiles::mistakes, 0);
}

}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();
