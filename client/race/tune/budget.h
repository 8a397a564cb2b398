#pragma once

#include <cstddef>
#include <optional>

namespace gatefield::race {

/// What a search may cost; both: the first that is reached counts. @pre one of them at least
struct Budget {
  std::optional<std::size_t> trials;  ///< the comparison's included
  std::optional<double> minutes;      ///< wall clock, the comparison's included
};

/// What a search costs.
struct Costs {
  std::size_t generation = 0;         ///< trials of one
  std::size_t comparison = 0;         ///< trials
  std::optional<double> per_trial_s;  ///< wall clock, with all workers at work; not known before the first generation
};

/// How many generations the budget has room for, with the comparison after them; 0: not even one. Minutes count from
/// the first known cost on: a search that is told minutes alone flies one generation anyhow.
std::size_t generations_within(const Budget& budget, const Costs& costs) noexcept;

}  // namespace gatefield::race
