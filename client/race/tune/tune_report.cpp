#include "client/race/tune/tune_report.h"

#include <fmt/format.h>

#include <system_error>

#include "client/race/files.h"
#include "client/race/report.h"
#include "client/race/tune/comparison.h"
#include "common/plot/table.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

constexpr double kBorder = 0.02;  // in parts of the range

plot::Table fields_table(const Space& space, const Point& found) {
  plot::Table table;
  table.title = "What was looked for";
  table.columns = {"field", "base", "found", "from", "to", "scale"};
  std::string at_border;
  for (std::size_t i = 0; i < space.size(); ++i) {
    const Dimension& d = space.dimensions()[i];
    table.rows.push_back({d.name, space.value(space.start(), i), space.value(found, i), fmt::format("{:.4g}", d.min),
                          fmt::format("{:.4g}", d.max), d.logarithmic ? "logarithmic" : "linear"});
    if (found[i] <= kBorder || found[i] >= 1.0 - kBorder) at_border += (at_border.empty() ? "" : ", ") + d.name;
  }
  if (!at_border.empty()) table.note = "At the border of its range, which may have been too narrow: " + at_border + ".";
  return table;
}

}  // namespace

std::string found_text(const Tune& tune, std::size_t generations, const ProfileSheet& base, const ProfileSheet& found) {
  std::string races;
  for (const Cell& cell : tune.races.cells)
    for (const double speed_m_s : cell.speeds_m_s)
      races +=
          fmt::format("#   {} at {:g} m/s, seeds {} to {}\n", cell.title, speed_m_s, cell.seeds.first, cell.seeds.last);
  return fmt::format(
      "# Found by gatefield-race tune in {} generations from the profile '{}', on these races:\n{}"
      "# Every field stands here, with its range; those that were changed say what they were.\n{}",
      generations, base.name(), races, found.text(&base));
}

Result<TuneReport> write_tune_report(const Tune& tune, const Space& space, const Search& search,
                                     const Campaign& comparison, const std::vector<TrialResult>& results,
                                     const fs::path& folder, const fs::path& comparison_folder,
                                     const ProfileSheet& found) {
  const auto campaign_report = write_report(comparison_folder);
  if (!campaign_report) return campaign_report.failure();
  const Verdict judged = verdict(pairs_of(comparison, results));
  const plot::Table table = comparison_of(comparison, results);
  const plot::Table fields = fields_table(space, search.found());

  std::string page = fmt::format("# {}\n\n{}\n\n", tune.title, judged.sentence);
  page += fmt::format(
      "{} generations from the profile `{}`, each on {} seeds of each cell; then both on seeds {} to {}, "
      "which nothing was tuned on.\n\n",
      search.generations().size(), tune.base_profile, tune.seeds_per_generation, tune.fresh_seeds.first,
      tune.fresh_seeds.last);
  page += plot::to_markdown(table) + "\n" + plot::to_markdown(fields) + "\n";
  std::error_code failure;
  if (fs::exists(folder / "figures/progress.png", failure)) page += "![Scores by generation](figures/progress.png)\n\n";
  page += fmt::format(
      "Found: [{0}.txt](profiles/{0}.txt), flown by `gatefield-server --profiles profiles` and clients that "
      "ask for `{0}`. Every race of the comparison: [{1}/report/report.md]({1}/report/report.md).\n",
      found.name(), comparison_folder.filename().string());
  TuneReport out{folder / "report.md",
                 plot::to_text(table) + "\n" + plot::to_text(fields) + "\n" + judged.sentence + "\n"};
  if (auto status = put_file(out.page, page); !status) return status.failure();
  if (auto status = put_file(folder / "comparison.csv", plot::to_csv(table)); !status) return status.failure();
  return out;
}

}  // namespace gatefield::race
