#pragma once

#include <string>
#include <vector>

#include "client/race/summary.h"
#include "common/plot/table.h"

/// Races lost: how often by which kind and cause, and how to fly each of them again. Thread-safe: yes.
namespace gatefield::race {

/// How often each kind of failure happened, by cell and speed; no row without a failure.
plot::Table failure_table(const std::vector<Line>& lines);
/// What races were lost by, and how far the belief was off in each case; no row without a failure.
plot::Table cause_table(const Campaign& campaign, const std::vector<Line>& lines,
                        const std::vector<TrialResult>& results);
/// The command lines that fly lost trials again, for people: first what server to start, then a line a trial.
std::string failure_list(const Campaign& campaign, const std::vector<TrialResult>& results);

}  // namespace gatefield::race
