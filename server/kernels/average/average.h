#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "server/kernels/rollout/rollout.h"

/// Softmax average of the samples (paper, Eq. "mppi_update"):
///   w_m = exp(-(J_m - min J) / lambda) / sum_n exp(-(J_n - min J) / lambda)
///   U*  = sum_m w_m U_m
/// Tolerance against the reference: 1e-6 + 1e-4 w of a weight. All functions are thread-safe and real-time safe.
namespace gatefield::kernels {

/// A lower temperature counts as this one: all the weight goes to the least cost.
inline constexpr double kMinTemperature = 1e-30;

struct ExponentialSums {
  double sum = 0.0;
  double sum_of_squares = 0.0;
};

/// The loops by one instruction set, see simd.cpp.
struct AverageLoops {
  /// Least finite cost; infinity when there is none.
  float (*least_cost)(const float* cost, std::size_t count);
  /// Sums of e = exp(-(J - least) / temperature) and of e^2; writes every e when `out` is given.
  ExponentialSums (*sum_exponentials)(const float* cost, std::size_t count, float least, float inverse_temperature,
                                      float* out);
  void (*scale)(float* values, std::size_t count, float factor);
  /// accumulate_average(), which is this loop.
  void (*accumulate)(const float* weight, std::size_t count, const SampleBlock& inputs, double* mean);
};
/// For a Highway target that this build has.
AverageLoops average_loops(std::int64_t target) noexcept;

/// Backend::softmax_weights():
/// @param cost     [M]; not finite counts as infinitely expensive
/// @param weight   out [M], normalised to sum 1 (all zero when no cost is finite)
/// @return effective sample size 1 / sum w^2; 0 when no cost is finite
double softmax_weights(const AverageLoops& loops, std::span<const float> cost, double temperature,
                       std::span<float> weight) noexcept;
double softmax_weights_reference(std::span<const float> cost, double temperature, std::span<float> weight) noexcept;

/// Backend::temperature_for(): the temperature in [low, high] for which the effective sample size is closest to the
/// target (bisection in log lambda); `high` when no cost is finite. @pre 0 < low <= high
double temperature_for(const AverageLoops& loops, std::span<const float> cost, double target_effective_samples,
                       double low, double high) noexcept;

/// Backend::accumulate_average(): mean[k][i] += sum_m weight[m] inputs[k][i][m] over one block.
/// @param weight  the block's part; weight.size() samples are read
/// @param mean    [K][4], double so that the result doesn't depend on how the samples are cut into blocks beyond 1e-12
///                of its size
void accumulate_average_reference(std::span<const float> weight, SampleBlock inputs, double* mean) noexcept;

}  // namespace gatefield::kernels
