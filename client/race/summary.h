#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"
#include "common/base/interval.h"

/// What came of the trials of a cell at one speed. Thread-safe: yes.
namespace gatefield::race {

/// All trials of a cell at one speed.
struct Line {
  std::string cell;
  double speed_m_s = 0.0;
  std::string profile;
  std::size_t trials = 0, won = 0;
  std::size_t won_after_a_miss = 0;   ///< of those won: a gate was missed and flown again
  double top_speed_m_s = 0.0;         ///< the highest that was reached
  double median_time_s = 0.0;         ///< of races won; NaN: none
  double smallest_clearance_m = 0.0;  ///< of races won; NaN: none
  double median_round_trip_ms = 0.0;
  std::map<Failure, std::size_t> failures;
  std::map<Cause, std::size_t> causes;
  std::set<std::uint64_t> setups, models;

  double success() const noexcept { return trials > 0 ? static_cast<double>(won) / static_cast<double>(trials) : 0.0; }
  Interval interval() const noexcept { return wilson(won, trials); }
};

/// Median of the finite ones among the values, of an even number the mean of the middle two; NaN without any.
double median_of(std::vector<double> values);

/// A line for each cell and speed with trials. In the campaign's order; what it does not know comes last.
std::vector<Line> summarize(const Campaign& campaign, const std::vector<TrialResult>& results);

}  // namespace gatefield::race
