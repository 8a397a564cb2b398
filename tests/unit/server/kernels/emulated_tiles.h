#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace gatefield::kernels {

/// AMX's tiles in plain code, to the bit as Intel's manual defines them (TDPBF16PS, Operation): products of even and of
/// odd elements are summed apart by fused multiply-adds from zero, then added, then added to the destination; subnormal
/// numbers count as zero, on the way in and out; rounding to nearest. Loads and stores of rows that are 64 bytes apart.
/// Using a tile that isn't configured is noticed.
struct EmulatedTiles {
  static inline std::uint32_t registers[8][16][16];
  static inline bool configured = false;
  static inline int mistakes = 0;

  static float flushed(float value) {
    return std::fpclassify(value) == FP_SUBNORMAL ? std::copysign(0.0f, value) : value;
  }

  static void Configure() {
    std::memset(registers, 0, sizeof registers);
    configured = true;
  }
  static void Release() { configured = false; }
  template <int kT>
  static void Zero() {
    mistakes += configured ? 0 : 1;
    std::memset(registers[kT], 0, sizeof registers[kT]);
  }
  template <int kT>
  static void Load(const std::uint32_t* from) {
    mistakes += configured ? 0 : 1;
    std::memcpy(registers[kT], from, sizeof registers[kT]);
  }
  template <int kT>
  static void Store(float* to) {
    mistakes += configured ? 0 : 1;
    std::memcpy(to, registers[kT], sizeof registers[kT]);
  }
  template <int kC, int kA, int kB>
  static void Dot() {
    mistakes += configured ? 0 : 1;
    const auto low = [](std::uint32_t pair) { return flushed(std::bit_cast<float>(pair << 16)); };
    const auto high = [](std::uint32_t pair) { return flushed(std::bit_cast<float>(pair & 0xffff0000u)); };
    for (int m = 0; m < 16; ++m) {
      float even[16] = {}, odd[16] = {};
      for (int k = 0; k < 16; ++k) {
        const float a0 = low(registers[kA][m][k]), a1 = high(registers[kA][m][k]);
        for (int n = 0; n < 16; ++n) {
          even[n] = flushed(std::fma(a0, low(registers[kB][k][n]), even[n]));
          odd[n] = flushed(std::fma(a1, high(registers[kB][k][n]), odd[n]));
        }
      }
      for (int n = 0; n < 16; ++n) {
        const float sum = flushed(even[n] + odd[n]);
        const float before = flushed(std::bit_cast<float>(registers[kC][m][n]));
        registers[kC][m][n] = std::bit_cast<std::uint32_t>(flushed(before + sum));
      }
    }
  }
};

}  // namespace gatefield::kernels
