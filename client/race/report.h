#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

/// The report of a campaign: tables (tables.h, losses.h, perceptions.h), figures (figures.h) and flights (flights.h) on
/// one page, and each as files.
namespace gatefield::race {

struct ReportFiles {
  std::filesystem::path folder;      ///< <results>/report
  std::string text;                  ///< the tables, for a terminal
  std::vector<std::string> remarks;  ///< what could not be drawn, and what a reader should know
};

/// Makes <folder>/report of <folder>'s campaign.txt and trials*.csv: report.md with everything, table.*, comparison.*,
/// failures.* (text, markdown, CSV), failures-to-fly.txt, and figures/ with success, failures and the flights of each
/// cell. Errors: the results can't be read, or the report can't be written. A missing gnuplot is a remark.
Result<ReportFiles> write_report(const std::filesystem::path& folder);

}  // namespace gatefield::race
