#pragma once

#include <span>

#include "server/kernels/rollout/rollout.h"

/// Softmax average of the samples (paper, Eq. "mppi_update"): w_m = exp(-(J_m - min J) / lambda) / sum, U* = sum_m w_m
/// U_m.
namespace gatefield::kernels {

/// A lower temperature counts as this one: all the weight goes to the least cost.
inline constexpr double kLeastTemperature = 1e-30;

/// @param cost     [M]; not finite counts as infinitely expensive
/// @param weight   out [M], normalised to sum 1 (all zero when no cost is finite)
/// @return effective sample size 1 / sum w^2; 0 when no cost is finite
/// Tolerance against the reference: 1e-6 + 1e-4 w. The functions of this file are thread-safe and real-time safe.
double softmax_weights(std::span<const float> cost, double temperature, std::span<float> weight) noexcept;

double softmax_weights_reference(std::span<const float> cost, double temperature, std::span<float> weight) noexcept;

/// Temperature in [low, high] for which the effective sample size is closest to `target` (bisection in log lambda);
/// `high` when no cost is finite. @pre 0 < low <= high
double temperature_for(std::span<const float> cost, double target_effective_samples, double low, double high) noexcept;

/// mean[k][i] += sum_m weight[m] inputs[k][i][m] over one block; `weight` is the block's part (weight.size() samples
/// are read). mean: [K][4], double so that the result doesn't depend on how the samples are cut into blocks beyond
/// 1e-12 of its size.
void accumulate_average(std::span<const float> weight, SampleBlock inputs, double* mean) noexcept;
void accumulate_average_reference(std::span<const float> weight, SampleBlock inputs, double* mean) noexcept;

}  // namespace gatefield::kernels
