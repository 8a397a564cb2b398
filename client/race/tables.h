#pragma once

#include <vector>

#include "client/race/summary.h"
#include "common/plot/table.h"

/// Success as tables: what was flown and won, and how that stands beside what others published. Thread-safe: yes.
namespace gatefield::race {

/// A line per cell and speed.
plot::Table success_table(const Campaign& campaign, const std::vector<Line>& lines);
/// A row per cell for which others published something, as the paper's table has it: success and speed, theirs and
/// ours at the cell's goal (without a goal: at its highest speed). No row without trials.
plot::Table comparison_table(const Campaign& campaign, const std::vector<Line>& lines);

}  // namespace gatefield::race
