#include <algorithm>
#include <cfloat>
#include <cmath>

#include "server/kernels/average/average.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/average/simd.cpp"
// The order matters here.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
// clang-format on

#include "server/kernels/target.h"

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::VFromD<D>;

HWY_INLINE V LoadPart(D d, const float* from, std::size_t count, float fill) {
  HWY_ALIGN_MAX float lanes[HWY_MAX_BYTES / sizeof(float)];
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) lanes[i] = i < count ? from[i] : fill;
  return hn::Load(d, lanes);
}

HWY_INLINE double SumLanes(D d, V value) {
  HWY_ALIGN_MAX float lanes[HWY_MAX_BYTES / sizeof(float)];
  hn::Store(value, d, lanes);
  double sum = 0.0;
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) sum += static_cast<double>(lanes[i]);
  return sum;
}

HWY_INLINE auto IsNumber(D d, V value) { return hn::Le(hn::Abs(value), hn::Set(d, FLT_MAX)); }

float LeastCost(const float* cost, std::size_t count) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  const V infinity = hn::Set(d, HUGE_VALF);
  V least = infinity;
  std::size_t m = 0;
  for (; m + N <= count; m += N) {
    const V J = hn::LoadU(d, cost + m);
    least = hn::Min(least, hn::IfThenElse(IsNumber(d, J), J, infinity));
  }
  if (m < count) {
    const V J = LoadPart(d, cost + m, count - m, HUGE_VALF);
    least = hn::Min(least, hn::IfThenElse(IsNumber(d, J), J, infinity));
  }
  return hn::GetLane(hn::MinOfLanes(d, least));
}

HWY_INLINE V Exponential(D d, V J, V least, V inverse_temperature) {
  const V exponent = hn::Mul(hn::Sub(least, J), inverse_temperature);
  // Below e^-87 numbers become subnormal, slow and of no weight: zero. The bound keeps the exponent finite, too.
  const V bound = hn::Set(d, -87.0f);
  return hn::IfThenElseZero(hn::And(IsNumber(d, J), hn::Gt(exponent, bound)), hn::Exp(d, hn::Max(exponent, bound)));
}

ExponentialSums SumExponentials(const float* cost, std::size_t count, float least_cost, float inverse_temperature,
                                float* out) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  const V least = hn::Set(d, least_cost), inverse = hn::Set(d, inverse_temperature);
  V sum = hn::Zero(d), squares = hn::Zero(d);
  std::size_t m = 0;
  for (; m + N <= count; m += N) {
    const V e = Exponential(d, hn::LoadU(d, cost + m), least, inverse);
    sum = hn::Add(sum, e);
    squares = hn::MulAdd(e, e, squares);
    if (out != nullptr) hn::StoreU(e, d, out + m);
  }
  if (m < count) {
    const V e = Exponential(d, LoadPart(d, cost + m, count - m, HUGE_VALF), least, inverse);
    sum = hn::Add(sum, e);
    squares = hn::MulAdd(e, e, squares);
    if (out != nullptr) {
      HWY_ALIGN_MAX float lanes[HWY_MAX_BYTES / sizeof(float)];
      hn::Store(e, d, lanes);
      for (std::size_t i = 0; m + i < count; ++i) out[m + i] = lanes[i];
    }
  }
  return {SumLanes(d, sum), SumLanes(d, squares)};
}

void Scale(float* values, std::size_t count, float factor) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  std::size_t m = 0;
  for (; m + N <= count; m += N) hn::StoreU(hn::Mul(hn::LoadU(d, values + m), hn::Set(d, factor)), d, values + m);
  for (; m < count; ++m) values[m] *= factor;
}

void AccumulateAll(const float* weight, std::size_t count, const SampleBlock& inputs, double* mean) {
  const hn::ScalableTag<double> dd;
  const hn::Rebind<float, decltype(dd)> df;
  using VD = hn::VFromD<decltype(dd)>;
  const std::size_t N = hn::Lanes(dd);
  const int rows = inputs.steps * inputs.channels;
  for (int row = 0; row < rows; ++row) {
    const float* u = inputs.row(0, row);
    VD sum0 = hn::Zero(dd), sum1 = hn::Zero(dd);
    std::size_t m = 0;
    for (; m + 2 * N <= count; m += 2 * N) {
      sum0 = hn::MulAdd(hn::PromoteTo(dd, hn::LoadU(df, weight + m)), hn::PromoteTo(dd, hn::LoadU(df, u + m)), sum0);
      sum1 = hn::MulAdd(hn::PromoteTo(dd, hn::LoadU(df, weight + m + N)), hn::PromoteTo(dd, hn::LoadU(df, u + m + N)),
                        sum1);
    }
    double sum = hn::GetLane(hn::SumOfLanes(dd, hn::Add(sum0, sum1)));
    for (; m < count; ++m) sum += static_cast<double>(weight[m]) * static_cast<double>(u[m]);
    mean[row] += sum;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gatefield::kernels {

HWY_EXPORT(LeastCost);
HWY_EXPORT(SumExponentials);
HWY_EXPORT(Scale);
HWY_EXPORT(AccumulateAll);

namespace {

float inverse_of(double temperature) noexcept {
  return static_cast<float>(1.0 / std::max(temperature, kMinTemperature));
}

}  // namespace

AverageLoops average_loops(std::int64_t target) noexcept {
  return {GATEFIELD_OF_TARGET(LeastCost, target), GATEFIELD_OF_TARGET(SumExponentials, target),
          GATEFIELD_OF_TARGET(Scale, target), GATEFIELD_OF_TARGET(AccumulateAll, target)};
}

double softmax_weights(const AverageLoops& loops, std::span<const float> cost, double temperature,
                       std::span<float> weight) noexcept {
  const float least = loops.least_cost(cost.data(), cost.size());
  if (!std::isfinite(least)) {
    std::fill(weight.begin(), weight.end(), 0.0f);
    return 0.0;
  }
  const ExponentialSums sums =
      loops.sum_exponentials(cost.data(), cost.size(), least, inverse_of(temperature), weight.data());
  loops.scale(weight.data(), cost.size(), static_cast<float>(1.0 / sums.sum));
  return sums.sum * sums.sum / sums.sum_of_squares;
}

double temperature_for(const AverageLoops& loops, std::span<const float> cost, double target_effective_samples,
                       double low, double high) noexcept {
  const float least = loops.least_cost(cost.data(), cost.size());
  if (!std::isfinite(least)) return high;
  const auto effective_samples = [&](double temperature) {
    const ExponentialSums sums =
        loops.sum_exponentials(cost.data(), cost.size(), least, inverse_of(temperature), nullptr);
    return sums.sum * sums.sum / sums.sum_of_squares;
  };
  // The effective sample size grows with the temperature.
  if (!(effective_samples(low) < target_effective_samples)) return low;
  if (!(effective_samples(high) > target_effective_samples)) return high;
  double log_low = std::log(low), log_high = std::log(high);
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (log_low + log_high);
    (effective_samples(std::exp(middle)) < target_effective_samples ? log_low : log_high) = middle;
  }
  return std::exp(0.5 * (log_low + log_high));
}

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
