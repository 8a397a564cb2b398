#pragma once

#include <span>

#include "server/kernels/rollout/rollout.h"

/// Softmax average of the samples (paper, Eq. "mppi_update"): w_m = exp(-(J_m - min J) / lambda) / sum, U* = sum_m w_m U_m.
namespace gatefield::kernels {

/// @param cost     [M]; not finite counts as infinitely expensive
/// @param weight   out [M], normalised to sum 1 (all zero when no cost is finite)
/// @return effective sample size 1 / sum w^2; 0 when no cost is finite
double softmax_weights(std::span<const float> cost, double temperature, std::span<float> weight) noexcept;

/// Temperature in [low, high] for which the effective sample size is closest to `target` (bisection in log lambda).
double temperature_for(std::span<const float> cost, double target_effective_samples, double low, double high) noexcept;

/// mean[k][i] += sum_m weight[m] inputs[k][i][m] over one block; `weight` is the block's part. mean: [K][4], double for order-independence of size.
void accumulate_average(std::span<const float> weight, SampleBlock inputs, double* mean) noexcept;

}  // namespace gatefield::kernels
