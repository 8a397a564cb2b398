#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/plot/chart.h"
#include "server/training/evaluation/evaluate.h"

namespace gatefield::training {

/// The pictures of an evaluation, with the name of each one's file.
std::vector<std::pair<std::string, plot::Chart>> charts_of(const Evaluation& evaluation);

}  // namespace gatefield::training
