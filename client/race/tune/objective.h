#pragma once

#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"

/// What is better. Thread-safe: yes.
namespace gatefield::race {

/// What one race is worth, from 0 to 1.5:
///   lost:  0.5 times the part of the race that was flown: gates passed, and of the way to the next one what was left
///          behind, of all gates;
///   won:   1 + 0.3 min(1, clearance / c) + 0.2 min(1, t / time),
/// c half of what a passage through the middle of the course's narrowest gate leaves beside the hull, t the nominal
/// course's length at the speed limit. A won race is worth at least twice any lost one, so winning comes first; a lost
/// one still says which way is up, and nothing is gained by being faster than the limit.
double score(const Cell& cell, const TrialResult& result);

/// Length of the nominal course, from the start through all laps, m.
double course_length_m(const Cell& cell);

/// What one profile did.
struct Score {
  std::size_t trials = 0, won = 0;
  double mean = 0.0;         ///< of score() over all trials; NaN without any
  double clearance_m = 0.0;  ///< median, of races won; NaN: none
  double time_s = 0.0;       ///< likewise
};
/// @param races  where the results' cells are found
Score summarize_scores(const Campaign& races, const std::vector<TrialResult>& results);

/// How likely coins that are fair would be at least so one-sided: the exact two-sided sign test. 1 when both are 0.
double sign_test(std::size_t ups, std::size_t downs);

}  // namespace gatefield::race
