#include "client/race/tune/comparison.h"

#include <fmt/format.h>

#include <map>
#include <tuple>

#include "client/race/summary.h"

namespace gatefield::race {
namespace {

constexpr double kSurprise = 0.05;

std::string without(const std::string& name, std::string_view ending) {
  return name.ends_with(ending) ? name.substr(0, name.size() - ending.size()) : std::string();
}

}  // namespace

std::vector<Pair> pairs_of(const Campaign& comparison, const std::vector<TrialResult>& results) {
  std::map<std::tuple<std::string, double, std::uint64_t>, const TrialResult*> base;
  for (const TrialResult& result : results)
    if (const std::string cell = without(result.cell, kBaseEnding); !cell.empty())
      base[{cell, result.speed_m_s, result.seed}] = &result;
  std::vector<Pair> pairs;
  for (const TrialResult& result : results) {
    const auto at = base.find({without(result.cell, kFoundEnding), result.speed_m_s, result.seed});
    if (at == base.end()) continue;
    pairs.push_back({*at->second, result, score(*comparison.find(at->second->cell), *at->second),
                     score(*comparison.find(result.cell), result)});
  }
  return pairs;
}

Verdict verdict(const std::vector<Pair>& pairs) {
  std::size_t base_alone = 0, found_alone = 0, both = 0, higher = 0, lower = 0;
  for (const Pair& pair : pairs) {
    if (pair.base.won() && !pair.found.won()) ++base_alone;
    if (!pair.base.won() && pair.found.won()) ++found_alone;
    if (!pair.base.won() || !pair.found.won()) continue;
    ++both;
    if (pair.found_score > pair.base_score) ++higher;
    if (pair.found_score < pair.base_score) ++lower;
  }
  const double won_p = sign_test(found_alone, base_alone), score_p = sign_test(higher, lower);
  const std::string alone =
      fmt::format("of {} races, {} were won by the found profile alone and {} by the base alone (p {:.2g})",
                  pairs.size(), found_alone, base_alone, won_p);
  const std::string scored =
      fmt::format("of the {} that both won, the found one scored higher in {} and lower in {} (p {:.2g})", both, higher,
                  lower, score_p);
  if (won_p <= kSurprise && found_alone > base_alone)
    return {true, "The found profile is better: it wins more often; " + alone + "."};
  if (won_p <= kSurprise)
    return {false, "The found profile is WORSE: it wins less often; " + alone + ". Keep the base."};
  if (found_alone >= base_alone && score_p <= kSurprise && higher > lower)
    return {true, "The found profile is better: it wins no less often, with more clearance or sooner; " + alone + "; " +
                      scored + "."};
  if (score_p <= kSurprise && lower > higher)
    return {false, "The found profile is WORSE: it wins no more often, with less clearance or later; " + alone + "; " +
                       scored + ". Keep the base."};
  return {false, "The found profile is NOT shown to be better than the base; " + alone + "; " + scored +
                     ". Keep the base, or tune with a larger budget."};
}

plot::Table comparison_of(const Campaign& comparison, const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = comparison.title;
  table.columns = {"races",   "profile",  "speed limit [m/s]",    "flown",           "won",
                   "low [%]", "high [%]", "median clearance [m]", "median time [s]", "score"};
  for (const Cell& cell : comparison.cells)
    for (const double speed_m_s : cell.speeds_m_s) {
      std::vector<TrialResult> own;
      for (const TrialResult& result : results)
        if (result.cell == cell.name && result.speed_m_s == speed_m_s) own.push_back(result);
      const Score all = summarize_scores(comparison, own);
      const Interval interval = wilson(all.won, all.trials);
      table.rows.push_back({cell.series,
                            cell.profile,
                            {speed_m_s, 1},
                            {static_cast<double>(all.trials), 0},
                            {static_cast<double>(all.won), 0},
                            {100 * interval.low, 0},
                            {100 * interval.high, 0},
                            {all.clearance_m, 3},
                            {all.time_s, 2},
                            {all.mean, 3}});
    }
  table.note =
      "low, high: 95 % Wilson interval of the share won. Clearance (the least of a race) and time: medians of the "
      "races won. "
      "Score: 0 to 1.5, docs/tuning.md.";
  return table;
}

}  // namespace gatefield::race
