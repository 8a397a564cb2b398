#pragma once

#include <string>

#include "client/race/trial_result.h"
#include "common/base/result.h"

/// Results as lines of trials.csv: the one place that knows its columns.
namespace gatefield::race {

/// The header of trials.csv, without a line end.
std::string csv_header();
/// One line, without a line end.
std::string csv_line(const TrialResult& result);
/// Errors: says which column is wrong.
Result<TrialResult> parse_csv_line(const std::string& line);

}  // namespace gatefield::race
