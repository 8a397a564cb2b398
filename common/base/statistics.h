#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

/// The one quantile of this project. Thread-safe: yes.
namespace gatefield {

/// What a quantile is that falls between two values.
enum class Between {
  kNearest,  ///< the nearer of the two, half-way the larger one: always one of the values
  kLinear,   ///< on the line between them, so that the median of an even number is the mean of the middle two
};

/// The value below which `part` of the values lie. Sorted, value i of n stands for the part i / (n - 1): the smallest
/// for 0, the largest for 1 (R. J. Hyndman, Y. Fan, "Sample Quantiles in Statistical Packages", 1996,
/// doi:10.2307/2684934: definition 7).
/// @param values  reordered; no NaN among them
/// @param part    0 to 1
/// @return NaN when there are no values
/// Real-time safe: yes (linear in the number of values, no allocation).
template <std::floating_point T>
T quantile_in_place(std::span<T> values, double part, Between between = Between::kNearest) noexcept {
  assert(part >= 0.0 && part <= 1.0);
  if (values.empty()) return std::numeric_limits<T>::quiet_NaN();
  const double place = part * static_cast<double>(values.size() - 1);
  const auto nth = [&](double index) { return values.begin() + static_cast<std::ptrdiff_t>(index); };
  const auto low = nth(between == Between::kNearest ? place + 0.5 : place);
  std::nth_element(values.begin(), low, values.end());
  const double weight = place - std::floor(place);
  if (between == Between::kNearest || weight == 0.0) return *low;
  const T above = *std::min_element(low + 1, values.end());
  return static_cast<T>((1.0 - weight) * static_cast<double>(*low) + weight * static_cast<double>(above));
}

/// The same of a copy. Real-time safe: no.
inline double quantile(std::vector<double> values, double part, Between between = Between::kNearest) {
  return quantile_in_place(std::span(values), part, between);
}

}  // namespace gatefield
