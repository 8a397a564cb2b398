#pragma once

#include <array>
#include <cstdint>

#include "server/kernels/rollout/rollout.h"

/// Gaussian samples for the inputs:
///   u[k][i][m] = mean[k][i] + sum_j mixer[i][j] sigma[j] n[k][j][m],   n standard normal
/// n comes from philox (common/base/random.h) and Box-Muller with counter (m, k, step): the same numbers for the same
/// (key, step) on one back end, whatever the blocks are; the key is a stream's (stream_key()). Tolerance between back
/// ends: |dn| <= 1e-5.
namespace gatefield::kernels {

struct NoiseShape {
  std::array<float, 4> sigma{3, 3, 3, 9};     ///< collective, roll, pitch, yaw, in rotor thrust rate N/s
  std::array<std::array<float, 4>, 4> mixer;  ///< [rotor][collective, roll, pitch, yaw], entries +-1
};

/// A block by one instruction set, see simd.cpp; factors[4 i + j] = mixer[i][j] sigma[j].
using SampleLoop = void(const float* factors, std::uint64_t key, std::uint64_t step, std::uint32_t first_sample,
                        const float* mean, const SampleBlock& inputs);
/// For a Highway target that this build has.
SampleLoop* sample_loop(std::int64_t target) noexcept;

/// Samples of one block (Backend::sample()).
/// @param mean          [K][4], the previous plan
/// @param first_sample  index of the block's first sample in the whole batch; global sample 0 gets no noise: it is the
///                      plan itself
/// @param inputs        out [K][4][M]
/// Thread-safe: yes.   Real-time safe: yes.
void sample(SampleLoop* loop, const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample,
            const float* mean, SampleBlock inputs) noexcept;
/// The same in double precision.
void sample_reference(const NoiseShape& shape, std::uint64_t key, std::uint64_t step, int first_sample,
                      const float* mean, SampleBlock inputs) noexcept;

}  // namespace gatefield::kernels
