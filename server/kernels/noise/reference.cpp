#include <cmath>
#include <numbers>

#include "common/base/random.h"
#include "server/kernels/noise/noise.h"

namespace gatefield::kernels {

void sample_reference(const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample,
                      const float* mean, SampleBlock inputs) noexcept {
  const std::array<std::uint32_t, 2> halves{static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)};
  const auto open_unit = [](std::uint32_t bits) { return (bits >> 9) * 0x1p-23 + 0x1p-24; };
  const auto turns = [](std::uint32_t bits) { return (bits >> 8) * 0x1p-24; };
  const int lanes = padded_samples(inputs.samples);
  for (int k = 0; k < inputs.steps; ++k) {
    for (int m = 0; m < lanes; ++m) {
      const auto index = static_cast<std::uint32_t>(first_sample) + static_cast<std::uint32_t>(m);
      const auto bits = philox({index, static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(step),
                                static_cast<std::uint32_t>(step >> 32)},
                               halves);
      std::array<double, 4> n{};
      if (index != 0) {
        for (std::size_t pair = 0; pair < 2; ++pair) {
          const double radius = std::sqrt(-2.0 * std::log(open_unit(bits[2 * pair])));
          const double angle_rad = 2.0 * std::numbers::pi * turns(bits[2 * pair + 1]);
          n[2 * pair] = radius * std::cos(angle_rad);
          n[2 * pair + 1] = radius * std::sin(angle_rad);
        }
      }
      for (std::size_t i = 0; i < kInputs; ++i) {
        double u = mean[static_cast<std::size_t>(k) * kInputs + i];
        for (std::size_t j = 0; j < 4; ++j) u += double{shape.mixer[i][j]} * shape.sigma[j] * n[j];
        inputs.row(k, static_cast<int>(i))[m] = static_cast<float>(u);
      }
    }
  }
}

}  // namespace gatefield::kernels
