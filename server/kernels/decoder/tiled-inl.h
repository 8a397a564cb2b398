// The decoder on tiles of 16 rows of 64 bytes, whoever multiplies them: AMX (amx_bf16.cpp) or, in unit tests, plain
// code that gives the same bits.
//
// A tile of weights has 16 neurons as rows and 32 inputs in them, one of activations 16 pairs of inputs as rows and 16
// points in them. Every factor is the sum of two bf16 numbers, f = hi + lo (2^-17 of f is lost), and of the products
// W_hi a_hi + W_hi a_lo + W_lo a_hi is taken, so that three multiplications give nearly single precision where one
// gives errors of centimetres. All hidden layers run like this, the output layer is a sum in single precision.
//
// Tiles:: has, with T, C, A, B numbers of tile registers 0 to 7,
//   Configure(), Release()          for this thread: eight registers of 16 rows of 64 bytes
//   Zero<T>(), Load<T>(from), Store<T>(to)           rows 64 bytes apart, aligned
//   Dot<C, A, B>()                  C[m][n] += sum_k A[m][2k] B[k][2n] + A[m][2k + 1] B[k][2n + 1], as TDPBF16PS
// Only compiler's vectors here, so that it can be compiled for any machine; nothing of the standard library.

#pragma once

#include <cstddef>
#include <cstdint>

#include "server/kernels/decoder/view.h"

namespace gatefield::kernels::tiled {

using Floats [[gnu::vector_size(64), gnu::may_alias]] = float;
using Words [[gnu::vector_size(64), gnu::may_alias]] = std::uint32_t;

constexpr std::size_t kTile = 16;               ///< neurons or points
constexpr std::size_t kTileInputs = 2 * kTile;  ///< of a layer in one tile
constexpr std::size_t kTileWords = kTile * kTile;

__attribute__((always_inline)) constexpr inline std::size_t tiles_for(std::size_t count, std::size_t size) {
  return (count + size - 1) / size;
}

/// Two neighbouring inputs of 16 points as pairs of bf16. The upper part is cut off, what remains is rounded.
__attribute__((always_inline)) inline void Split(const Floats& even, const Floats& odd, std::uint32_t* hi,
                                                 std::uint32_t* lo) {
  const Words upper = Words{} + 0xffff0000u, half = Words{} + 0x8000u;
  const Words e = (Words)even & upper, o = (Words)odd & upper;
  const Words e_rest = (Words)(even - (Floats)e) + half, o_rest = (Words)(odd - (Floats)o) + half;
  *reinterpret_cast<Words*>(hi) = e >> 16 | o;
  *reinterpret_cast<Words*>(lo) = e_rest >> 16 | (o_rest & upper);
}

/// Sums of kN blocks of 16 neurons for kP vectors of 16 points.
/// @param weights     [block][step of 32 inputs][hi, lo], tiles
/// @param activations [step][hi, lo][kP], tiles
/// @param sums        out [kN][kP], tiles
template <class Tiles, std::size_t kP, std::size_t kN>
__attribute__((always_inline)) inline void Multiply(const std::uint32_t* weights, const std::uint32_t* activations,
                                                    std::size_t steps, float* sums) {
  Tiles::template Zero<0>();
  if constexpr (kP > 1) Tiles::template Zero<1>();
  if constexpr (kN > 1) Tiles::template Zero<2>();
  if constexpr (kP > 1 && kN > 1) Tiles::template Zero<3>();
  const auto dot = [] {
    Tiles::template Dot<0, 4, 6>();
    if constexpr (kP > 1) Tiles::template Dot<1, 4, 7>();
    if constexpr (kN > 1) Tiles::template Dot<2, 5, 6>();
    if constexpr (kP > 1 && kN > 1) Tiles::template Dot<3, 5, 7>();
  };
  for (std::size_t step = 0; step < steps; ++step) {
    const std::uint32_t* w0 = weights + step * 2 * kTileWords;
    const std::uint32_t* w1 = w0 + steps * 2 * kTileWords;
    const std::uint32_t* a_hi = activations + step * 2 * kP * kTileWords;
    const std::uint32_t* a_lo = a_hi + kP * kTileWords;
    Tiles::template Load<4>(w0);
    if constexpr (kN > 1) Tiles::template Load<5>(w1);
    Tiles::template Load<6>(a_lo);
    if constexpr (kP > 1) Tiles::template Load<7>(a_lo + kTileWords);
    dot();
    Tiles::template Load<6>(a_hi);
    if constexpr (kP > 1) Tiles::template Load<7>(a_hi + kTileWords);
    dot();
    Tiles::template Load<4>(w0 + kTileWords);
    if constexpr (kN > 1) Tiles::template Load<5>(w1 + kTileWords);
    dot();
  }
  Tiles::template Store<0>(sums);
  if constexpr (kP > 1) Tiles::template Store<1>(sums + kTileWords);
  if constexpr (kN > 1) Tiles::template Store<2>(sums + kP * kTileWords);
  if constexpr (kP > 1 && kN > 1) Tiles::template Store<3>(sums + (kP + 1) * kTileWords);
}

/// The network for kP (1 or 2) vectors of 16 encoded points.
/// @param encoded  [input][kP][16], aligned, with room for kTileInputs - 1 more inputs, which it sets to zero
/// @param sdf      out [kP][16]
/// @pre at least one hidden layer; every hidden layer has `tiles`
template <class Tiles, std::size_t kP>
void Run(const DecoderView& net, float* encoded, float* sdf) {
  static_assert(kP == 1 || kP == 2);
  alignas(64) std::uint32_t buffers[2][kMaxWidth * kP * kTile];  // hi and lo take as much as floats
  alignas(64) float sums[2 * kP * kTileWords];
  std::uint32_t* in = buffers[0];
  std::uint32_t* out = buffers[1];
  const auto place = [](std::uint32_t* tiles, std::size_t input, std::size_t p) {
    return tiles + (input / kTileInputs * 2 * kP + p) * kTileWords + input % kTileInputs / 2 * kTile;
  };

  const std::size_t inputs = net.layers[0].inputs;
  const std::size_t filled = tiles_for(inputs, kTileInputs) * kTileInputs;
  for (std::size_t i = inputs * kP * kTile; i < filled * kP * kTile; ++i) encoded[i] = 0.0f;
  for (std::size_t i = 0; i < filled; i += 2) {
    for (std::size_t p = 0; p < kP; ++p) {
      const float* even = encoded + (i * kP + p) * kTile;
      std::uint32_t* hi = place(in, i, p);
      Split(*reinterpret_cast<const Floats*>(even), *reinterpret_cast<const Floats*>(even + kP * kTile), hi,
            hi + kP * kTileWords);
    }
  }

  const LayerView& output = net.layers[net.layer_count - 1];
  Floats s[kP];
  for (std::size_t p = 0; p < kP; ++p) s[p] = Floats{} + output.bias[0];
  for (std::size_t l = 0; l + 1 < net.layer_count; ++l) {
    const LayerView& layer = net.layers[l];
    const bool last = l + 2 == net.layer_count;
    const std::size_t steps = tiles_for(layer.inputs, kTileInputs), blocks = tiles_for(layer.outputs, kTile);
    for (std::size_t block = 0; block < blocks; block += 2) {
      const std::uint32_t* weights = layer.tiles + block * steps * 2 * kTileWords;
      const std::size_t together = blocks - block < 2 ? 1 : 2;
      if (together == 2)
        Multiply<Tiles, kP, 2>(weights, in, steps, sums);
      else
        Multiply<Tiles, kP, 1>(weights, in, steps, sums);
      // Past the last neuron weights are zero: what fills up a tile of the next layer's inputs.
      const std::size_t most = last ? output.inputs : tiles_for(layer.outputs, kTileInputs) * kTileInputs;
      for (std::size_t j = 0; j < 2 * kTile && block * kTile + j < most; j += 2) {
        const std::size_t n = block * kTile + j;
        for (std::size_t p = 0; p < kP; ++p) {
          Floats a[2];
          for (std::size_t i = 0; i < 2; ++i) {
            const std::size_t row = j + i;
            if (row < together * kTile) {
              a[i] =
                  *reinterpret_cast<const Floats*>(sums + (row / kTile * kP + p) * kTileWords + row % kTile * kTile) +
                  layer.tile_bias[n + i];
              a[i] = a[i] > 0.0f ? a[i] : Floats{};
            } else {
              a[i] = Floats{};
            }
            if (last && n + i < output.inputs) s[p] += a[i] * output.weight[4 * (n + i)];
          }
          if (last) continue;
          std::uint32_t* hi = place(out, n, p);
          Split(a[0], a[1], hi, hi + kP * kTileWords);
        }
      }
    }
    std::uint32_t* const swap = in;
    in = out;
    out = swap;
  }
  for (std::size_t p = 0; p < kP; ++p) *reinterpret_cast<Floats*>(sdf + p * kTile) = s[p];
}

}  // namespace gatefield::kernels::tiled
