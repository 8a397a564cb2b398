#include <algorithm>
#include <cmath>
#include <limits>

#include "server/kernels/average/average.h"

namespace gatefield::kernels {

double softmax_weights_reference(std::span<const float> cost, double temperature, std::span<float> weight) noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const float J : cost) {
    if (std::isfinite(J)) least = std::min(least, double{J});
  }
  double sum = 0.0, sum_of_squares = 0.0;
  const auto unnormalised = [&](float J) {
    return std::isfinite(J) ? std::exp(-(J - least) / std::max(temperature, kMinTemperature)) : 0.0;
  };
  for (const float J : cost) {
    const double e = unnormalised(J);
    sum += e;
    sum_of_squares += e * e;
  }
  for (std::size_t m = 0; m < cost.size(); ++m) {
    weight[m] = sum > 0.0 ? static_cast<float>(unnormalised(cost[m]) / sum) : 0.0f;
  }
  return sum > 0.0 ? sum * sum / sum_of_squares : 0.0;
}

void accumulate_average_reference(std::span<const float> weight, SampleBlock inputs, double* mean) noexcept {
  for (int k = 0; k < inputs.steps; ++k) {
    for (int i = 0; i < inputs.channels; ++i) {
      const float* u = inputs.row(k, i);
      double sum = 0.0;
      for (std::size_t m = 0; m < weight.size(); ++m) sum += double{weight[m]} * u[m];
      mean[k * inputs.channels + i] += sum;
    }
  }
}

}  // namespace gatefield::kernels
