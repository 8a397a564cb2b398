#pragma once

#include <array>
#include <cstdint>

#include "server/kernels/rollout/rollout.h"

/// Gaussian samples for the inputs: u[k][i][m] = mean[k][i] + sum_j mixer[i][j] sigma[j] n[k][j][m], n standard normal.
/// n comes from philox (common/base/random.h) and Box-Muller with counter (m, k, step): the same numbers for the same
/// (seed, step) on one instruction set, whatever the blocks are. Tolerance between instruction sets: |dn| <= 1e-5.
namespace gatefield::kernels {

struct NoiseShape {
  std::array<float, 4> sigma{3, 3, 3, 9};     ///< collective, roll, pitch, yaw, in rotor thrust rate N/s
  std::array<std::array<float, 4>, 4> mixer;  ///< [rotor][collective, roll, pitch, yaw], entries +-1
};

/// @param mean          [K][4], the previous plan
/// @param first_sample  index of the block's first sample in the whole batch; global sample 0 gets no noise (the plan
/// itself)
/// @param inputs        out [K][4][M]
/// Thread-safe: yes.   Real-time safe: yes.
void sample(const NoiseShape& shape, std::uint64_t seed, std::uint64_t step, int first_sample, const float* mean,
            SampleBlock inputs) noexcept;
void sample_reference(const NoiseShape& shape, std::uint64_t seed, std::uint64_t step, int first_sample,
                      const float* mean, SampleBlock inputs) noexcept;

}  // namespace gatefield::kernels
