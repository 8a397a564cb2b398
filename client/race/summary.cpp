#include "client/race/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/statistics.h"

namespace gatefield::race {

double median_of(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  return quantile(std::move(values), 0.5, Between::kLinear);
}

std::vector<Line> summarize(const Campaign& campaign, const std::vector<TrialResult>& results) {
  std::vector<Line> lines;
  const auto line_of = [&](const std::string& cell, double speed_m_s) -> Line& {
    for (Line& line : lines)
      if (line.cell == cell && line.speed_m_s == speed_m_s) return line;
    lines.push_back({});
    lines.back().cell = cell;
    lines.back().speed_m_s = speed_m_s;
    return lines.back();
  };
  for (const Cell& cell : campaign.cells)
    for (const double speed_m_s : cell.speeds_m_s) line_of(cell.name, speed_m_s).profile = cell.profile;
  std::map<std::pair<std::string, double>, std::array<std::vector<double>, 3>> values;  // times, clearances, trips
  for (const TrialResult& result : results) {
    Line& line = line_of(result.cell, result.speed_m_s);
    line.profile = result.profile;
    ++line.trials;
    if (result.won()) ++line.won;
    if (result.won() && result.missed > 0) ++line.won_after_a_miss;
    if (!result.won()) ++line.failures[result.failure];
    if (!result.won()) ++line.causes[result.cause];
    if (std::isfinite(result.top_speed_m_s)) line.top_speed_m_s = std::max(line.top_speed_m_s, result.top_speed_m_s);
    line.setups.insert(result.setup);
    line.models.insert(result.model);
    auto& [times, clearances, trips] = values[{line.cell, line.speed_m_s}];
    if (result.won()) times.push_back(result.time_s);
    if (result.won()) clearances.push_back(result.clearance_m);
    if (result.failure != Failure::kLostServer) trips.push_back(result.round_trip_p50_ms);
  }
  for (Line& line : lines) {
    auto& [times, clearances, trips] = values[{line.cell, line.speed_m_s}];
    line.median_time_s = median_of(times);
    std::erase_if(clearances, [](double v) { return !std::isfinite(v); });
    line.smallest_clearance_m = clearances.empty() ? std::numeric_limits<double>::quiet_NaN()
                                                   : *std::min_element(clearances.begin(), clearances.end());
    line.median_round_trip_ms = median_of(trips);
  }
  std::erase_if(lines, [](const Line& line) { return line.trials == 0; });
  return lines;
}

}  // namespace gatefield::race
