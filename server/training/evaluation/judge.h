#pragma once

#include <vector>

#include "server/training/evaluation/evaluate.h"
#include "server/training/evaluation/targets.h"

namespace gatefield::training {

/// Errors by distance in simulation, of options.bundle: all places, 60 to 80 deg off the axis, half visible; both
/// modes. `where` names the row, `what` the column.
std::vector<Target> distance_targets(const Evaluation& evaluation);

/// Everything else: approach, wrong gates, two gates, gate-free frames, and the second sensor when a set of it is
/// there, with bundles called "stage 1" and "stage 2" to compare with.
std::vector<Target> other_targets(const Evaluation& evaluation);

}  // namespace gatefield::training
