#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/race/tune/objective.h"
#include "common/plot/table.h"

/// The base and what was found beside each other, on the same seeds. Thread-safe: yes.
namespace gatefield::race {

inline constexpr const char* kBaseEnding = "-base";    ///< of a cell's name in the comparison
inline constexpr const char* kFoundEnding = "-found";  ///< likewise

/// The same race flown by both.
struct Pair {
  TrialResult base, found;
  double base_score = 0.0, found_score = 0.0;
};
/// @param comparison  cells in twos, by their endings
std::vector<Pair> pairs_of(const Campaign& comparison, const std::vector<TrialResult>& results);

struct Verdict {
  bool better = false;
  std::string sentence;
};
/// Winning comes first: where the races that one of the two alone won are one-sided (sign test, 5 %), that decides.
/// Else what was found is better only if it won no fewer, and scored higher in the races that both won (likewise).
Verdict verdict(const std::vector<Pair>& pairs);

/// A row for each profile on each cell and speed, with the interval of its share won (95 %, Wilson).
plot::Table comparison_of(const Campaign& comparison, const std::vector<TrialResult>& results);

}  // namespace gatefield::race
