#pragma once

#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"
#include "common/plot/table.h"

/// What lies between the least and the usual: how near frames were passed, and how long laps took.
/// Thread-safe: yes.
namespace gatefield::race {

/// A row for each cell and speed: quantiles of the smallest distance from hull to frame at each passage of a gate, over
/// all gates that were passed in all races, won or lost.
plot::Table clearance_table(const Campaign& campaign, const std::vector<TrialResult>& results);

/// A row for each cell and speed: laps and speeds of the races won, and what was flown again.
plot::Table pace_table(const Campaign& campaign, const std::vector<TrialResult>& results);

}  // namespace gatefield::race
