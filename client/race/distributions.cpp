#include "client/race/distributions.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "client/race/summary.h"
#include "common/base/statistics.h"

namespace gatefield::race {
namespace {

/// Calls `add` for each cell and speed that was flown, in the campaign's order.
void for_each_line(
    const Campaign& campaign, const std::vector<TrialResult>& results,
    const std::function<void(const Cell&, double speed_m_s, const std::vector<const TrialResult*>&)>& add) {
  for (const Cell& cell : campaign.cells)
    for (const double speed_m_s : cell.speeds_m_s) {
      std::vector<const TrialResult*> flown;
      for (const TrialResult& result : results)
        if (result.cell == cell.name && result.speed_m_s == speed_m_s && result.failure != Failure::kLostServer)
          flown.push_back(&result);
      if (!flown.empty()) add(cell, speed_m_s, flown);
    }
}

double largest(const std::vector<double>& values) {
  return values.empty() ? std::numeric_limits<double>::quiet_NaN() : *std::max_element(values.begin(), values.end());
}

}  // namespace

plot::Table clearance_table(const Campaign& campaign, const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = "How near the frames were passed";
  table.columns = {"cell",    "speed limit [m/s]", "hull",     "passages",  "least [m]",
                   "1 % [m]", "5 % [m]",           "25 % [m]", "median [m]"};
  for_each_line(campaign, results, [&](const Cell& cell, double speed_m_s, const auto& flown) {
    std::vector<double> clearances_m;
    for (const TrialResult* result : flown)
      clearances_m.insert(clearances_m.end(), result->clearances_m.begin(), result->clearances_m.end());
    if (clearances_m.empty()) return;
    std::vector<plot::Cell> row{
        cell.title, {speed_m_s, 1}, std::string(flown.front()->hull), {static_cast<double>(clearances_m.size()), 0}};
    for (const double part : {0.0, 0.01, 0.05, 0.25, 0.5})
      row.emplace_back(quantile(clearances_m, part, Between::kLinear), 3);
    table.rows.push_back(std::move(row));
  });
  table.note =
      "Of every gate that was passed, in races won and lost: the smallest distance from the hull to its frame from "
      "coming near to leaving it; quantiles over gates and trials.";
  return table;
}

plot::Table pace_table(const Campaign& campaign, const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = "Laps, speeds and what was flown again";
  table.columns = {"cell",           "speed limit [m/s]", "won",       "none missed",      "gates missed", "retries",
                   "median lap [s]", "slowest lap [s]",   "top [m/s]", "median mean [m/s]"};
  for_each_line(campaign, results, [&](const Cell& cell, double speed_m_s, const auto& flown) {
    std::vector<double> median_laps_s, slowest_laps_s, tops_m_s, means_m_s;
    double won = 0, clean = 0, missed = 0, retries = 0;
    for (const TrialResult* result : flown) {
      missed += result->missed;
      retries += result->retries;
      if (!result->won()) continue;
      ++won;
      clean += result->missed == 0 ? 1 : 0;
      median_laps_s.push_back(result->median_lap_s);
      slowest_laps_s.push_back(result->slowest_lap_s);
      tops_m_s.push_back(result->top_speed_m_s);
      means_m_s.push_back(result->mean_speed_m_s);
    }
    table.rows.push_back({cell.title,
                          {speed_m_s, 1},
                          {won, 0},
                          {clean, 0},
                          {missed, 0},
                          {retries, 0},
                          {median_of(median_laps_s), 2},
                          {largest(slowest_laps_s), 2},
                          {largest(tops_m_s), 1},
                          {median_of(means_m_s), 2}});
  });
  table.note =
      "Laps and speeds: of races won; median lap: the median of the races' medians. None missed: races won without "
      "flying past a gate outside its frame; gates missed and retries: of all races, won and lost.";
  return table;
}

}  // namespace gatefield::race
