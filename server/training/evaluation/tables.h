#pragma once

#include <vector>

#include "common/plot/table.h"
#include "server/training/evaluation/evaluate.h"

namespace gatefield::training {

/// All that an evaluation says, as tables for people; the comparison of bundles comes last.
std::vector<plot::Table> tables_of(const Evaluation& evaluation);

}  // namespace gatefield::training
