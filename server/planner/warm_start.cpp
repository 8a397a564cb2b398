#include "server/planner/warm_start.h"

namespace gatefield::planner {

void shift_plan(double elapsed_s, double step_s, const PlainVector4& beyond, std::span<PlainVector4> inputs) noexcept {
  const PlainVector4 last = beyond;  // may lie among the inputs
  if (!(elapsed_s > 0.0)) return;
  const double shift = elapsed_s / step_s;
  const std::size_t count = inputs.size();
  if (!(shift < static_cast<double>(count))) {
    for (PlainVector4& u : inputs) u = last;
    return;
  }
  const std::size_t whole = static_cast<std::size_t>(shift);
  const double part = shift - static_cast<double>(whole);
  const auto at = [&](std::size_t k) -> PlainVector4 { return k < count ? inputs[k] : last; };
  for (std::size_t k = 0; k < count; ++k) {
    const PlainVector4 shifted =
        (1.0 - part) * at(k + whole) + part * at(k + whole + 1);  // reads only entries not yet overwritten
    inputs[k] = shifted;
  }
}

}  // namespace gatefield::planner
