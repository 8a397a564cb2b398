#pragma once

#include <vector>

#include "client/race/summary.h"
#include "common/plot/chart.h"

/// The figures that a campaign asks for. Thread-safe: yes.
namespace gatefield::race {

/// Success with its interval for one of the campaign's figures; without series when nothing was flown for it.
plot::Chart success_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines);
/// Failures by kind for the cells of a figure, as bars.
plot::Chart failure_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines);

}  // namespace gatefield::race
