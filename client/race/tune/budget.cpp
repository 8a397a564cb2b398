#include "client/race/tune/budget.h"

#include <algorithm>
#include <limits>

namespace gatefield::race {

std::size_t generations_within(const Budget& budget, const Costs& costs) noexcept {
  std::size_t generations = std::numeric_limits<std::size_t>::max();
  if (budget.trials)
    generations = *budget.trials < costs.comparison
                      ? 0
                      : (*budget.trials - costs.comparison) / std::max<std::size_t>(costs.generation, 1);
  if (budget.minutes && generations > 0) {
    std::size_t in_time = 1;
    if (costs.per_trial_s) {
      const double trials = 60.0 * *budget.minutes / std::max(*costs.per_trial_s, 1e-3);
      const double left = trials - static_cast<double>(costs.comparison);
      in_time = std::max<std::size_t>(
          1, static_cast<std::size_t>(std::max(0.0, left / static_cast<double>(costs.generation))));
    }
    generations = std::min(generations, in_time);
  }
  return generations;
}

}  // namespace gatefield::race
