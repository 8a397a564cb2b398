#pragma once

#include <cmath>
#include <cstddef>

namespace gatefield {

struct Interval {
  double low = 0.0, high = 1.0;
};

/// Wilson's score interval of a share, 95 %: what shares would make `counted` of `trials` no surprise (E. B. Wilson,
/// "Probable inference, the law of succession, and statistical inference", JASA 1927, doi:10.2307/2276774). It is right
/// for few trials and for shares near 0 and 1 too. @pre 0 <= counted <= trials; no trials: 0 to 1
/// Thread-safe: yes.   Real-time safe: yes.
inline Interval wilson(std::size_t counted, std::size_t trials) noexcept {
  if (trials == 0) return {};
  constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(counted) / n;
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n);
  // None or all: the formula gives the border itself, but for rounding.
  return {counted == 0 ? 0.0 : middle - half, counted == trials ? 1.0 : middle + half};
}

}  // namespace gatefield
