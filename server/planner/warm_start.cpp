#include "server/planner/warm_start.h"

namespace gatefield::planner {

void shift_plan(double elapsed_s, double step_s, std::span<ThrustRates> inputs) noexcept {
  if (!(elapsed_s > 0.0)) return;
  const double shift = elapsed_s / step_s;
  const std::size_t count = inputs.size();
  if (!(shift < static_cast<double>(count))) {
    for (ThrustRates& u : inputs) u.setZero();
    return;
  }
  const std::size_t whole = static_cast<std::size_t>(shift);
  const double part = shift - static_cast<double>(whole);
  const auto at = [&](std::size_t k) -> ThrustRates {
    return k < count ? inputs[k] : ThrustRates(ThrustRates::Zero());
  };
  for (std::size_t k = 0; k < count; ++k) {
    const ThrustRates shifted =
        (1.0 - part) * at(k + whole) + part * at(k + whole + 1);  // reads only entries not yet overwritten
    inputs[k] = shifted;
  }
}

}  // namespace gatefield::planner
