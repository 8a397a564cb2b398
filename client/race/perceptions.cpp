#include "client/race/perceptions.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace gatefield::race {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

plot::Table perception_table(const Campaign& campaign, const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = "Perceptions beside each other, same seeds";
  table.columns = {"cell", "speed limit [m/s]", "seeds"};
  for (const Perception perception : kPerceptions) table.columns.push_back(std::string(words(perception)) + " [%]");
  table.columns.insert(table.columns.end(), {"lost, won with the true pose", "lost with both"});
  for (const Cell& base : campaign.cells) {
    std::vector<const Cell*> cells{&base};
    for (const Cell& cell : campaign.cells)
      if (cell.beside == base.name) cells.push_back(&cell);
    if (cells.size() < 2) continue;
    for (const double speed_m_s : base.speeds_m_s) {
      // By cell: what became of each seed. Those count that every cell with this speed has flown.
      std::vector<std::map<std::uint64_t, bool>> won;
      std::vector<const Cell*> flown;
      for (const Cell* cell : cells) {
        std::map<std::uint64_t, bool> seeds;
        for (const TrialResult& result : results)
          if (result.cell == cell->name && result.speed_m_s == speed_m_s && result.failure != Failure::kLostServer)
            seeds[result.seed] = result.won();
        if (seeds.empty()) continue;
        won.push_back(std::move(seeds));
        flown.push_back(cell);
      }
      if (flown.size() < 2 || flown.front() != &base) continue;
      std::vector<std::uint64_t> common;
      for (const auto& [seed, unused] : won.front())
        if (std::all_of(won.begin(), won.end(), [s = seed](const auto& seeds) { return seeds.contains(s); }))
          common.push_back(seed);
      if (common.empty()) continue;
      std::vector<plot::Cell> row{base.title, {speed_m_s, 1}, {static_cast<double>(common.size()), 0}};
      const std::map<std::uint64_t, bool>*learned = nullptr, *truth = nullptr;
      for (const Perception perception : kPerceptions) {
        double share = kNone;
        for (std::size_t i = 0; i < flown.size(); ++i) {
          if (flown[i]->perception != perception) continue;
          const auto count =
              std::count_if(common.begin(), common.end(), [&](std::uint64_t seed) { return won[i].at(seed); });
          share = 100.0 * static_cast<double>(count) / static_cast<double>(common.size());
          if (perception == Perception::kLearned) learned = &won[i];
          if (perception == Perception::kTruePose) truth = &won[i];
        }
        row.emplace_back(share, 0);
      }
      double perceptions = kNone, both = kNone;
      if (learned != nullptr && truth != nullptr) {
        const auto count = [&](bool with_truth) {
          return static_cast<double>(std::count_if(common.begin(), common.end(), [&](std::uint64_t seed) {
            return !learned->at(seed) && truth->at(seed) == with_truth;
          }));
        };
        perceptions = count(true);
        both = count(false);
      }
      row.emplace_back(perceptions, 0);
      row.emplace_back(both, 0);
      table.rows.push_back(std::move(row));
    }
  }
  table.note =
      "Same planner, profile, seeds and gates; only what sees the gates differs. Lost, won with the true pose: "
      "perception's share of the learned field's losses; lost with both: control's.";
  return table;
}

}  // namespace gatefield::race
