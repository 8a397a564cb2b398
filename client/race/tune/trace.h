#pragma once

#include <string>
#include <vector>

#include "client/race/tune/search.h"
#include "common/plot/chart.h"

/// How a search went. Thread-safe: yes.
namespace gatefield::race {

/// A line for the base and each candidate of each generation, and one for the search's mean after it, which nobody
/// flew: generation, candidate, score, trials, won, clearance_m, time_s, then the fields.
std::string trace_csv(const Space& space, const std::vector<Generation>& generations);

/// Scores by generation: the best candidate, the median one, the base on the same seeds.
plot::Chart trace_chart(const std::string& title, const std::vector<Generation>& generations);

}  // namespace gatefield::race
