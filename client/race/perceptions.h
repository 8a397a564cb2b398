#pragma once

#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"
#include "common/plot/table.h"

namespace gatefield::race {

/// Cells beside each other (CellSpec.beside): at each speed the seeds that all of them flew, what share each perception
/// won, and, with a true pose among them, whose share the races are that the learned field lost. A row per cell that
/// others stand beside and speed.
plot::Table perception_table(const Campaign& campaign, const std::vector<TrialResult>& results);

}  // namespace gatefield::race
