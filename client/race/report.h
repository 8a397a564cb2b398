#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "client/race/campaign.h"
#include "client/race/trial_result.h"
#include "common/plot/chart.h"
#include "common/plot/table.h"

namespace gatefield::race {

struct Interval {
  double low = 0.0, high = 1.0;
};

/// Wilson's score interval of a share, 95 %: what shares would make `won` of `trials` no surprise (E. B. Wilson,
/// "Probable inference, the law of succession, and statistical inference", JASA 1927, doi:10.2307/2276774). It is right
/// for few trials and for shares near 0 and 1 too. @pre 0 <= won <= trials; no trials: 0 to 1
Interval wilson(std::size_t won, std::size_t trials) noexcept;

/// All trials of a cell at one speed.
struct Line {
  std::string cell;
  double speed_m_s = 0.0;
  std::string profile;
  std::size_t trials = 0, won = 0;
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

/// In the campaign's order; what it does not know comes last.
std::vector<Line> summarize(const Campaign& campaign, const std::vector<TrialResult>& results);

/// A line per cell and speed.
plot::Table success_table(const Campaign& campaign, const std::vector<Line>& lines);
/// A row per cell for which others published something, as the paper's table has it: success and speed, theirs and
/// ours at the cell's goal (without a goal: at its highest speed). No row without trials.
plot::Table comparison_table(const Campaign& campaign, const std::vector<Line>& lines);
/// How often each kind of failure happened, by cell and speed; no row without a failure.
plot::Table failure_table(const std::vector<Line>& lines);
/// What races were lost by, and how far the belief was off in each case; no row without a failure.
plot::Table cause_table(const Campaign& campaign, const std::vector<Line>& lines,
                        const std::vector<TrialResult>& results);
/// Cells beside each other (CellSpec.beside): at each speed the seeds that all of them flew, what share each perception
/// won, and, with a true pose among them, whose share the races are that the learned field lost. A row per cell that
/// others stand beside and speed.
plot::Table perception_table(const Campaign& campaign, const std::vector<TrialResult>& results);
/// Success with its interval for one of the campaign's figures; without series when nothing was flown for it.
plot::Chart success_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines);
/// Failures by kind for the cells of a figure, as bars.
plot::Chart failure_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines);

/// The command lines that fly lost trials again, for people: first what server to start, then a line a trial.
std::string failure_list(const Campaign& campaign, const std::vector<TrialResult>& results);

struct ReportFiles {
  std::filesystem::path folder;      ///< <results>/report
  std::string text;                  ///< the tables, for a terminal
  std::vector<std::string> remarks;  ///< what could not be drawn, and what a reader should know
};

/// Makes <folder>/report of <folder>'s campaign.txt and trials*.csv: report.md with everything, table.*, comparison.*,
/// failures.* (text, markdown, CSV), failures-to-fly.txt, and figures/ with success, failures and the flights of each
/// cell. Errors: the results can't be read, or the report can't be written. A missing gnuplot is a remark.
Result<ReportFiles> write_report(const std::filesystem::path& folder);

/// The path of a flight as a file for write_report(), 25 points a second.
std::string path_text(const simulator::Report& report);

}  // namespace gatefield::race
