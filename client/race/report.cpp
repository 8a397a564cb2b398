#include "client/race/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "client/race/campaign.h"
#include "client/race/distributions.h"
#include "client/race/figures.h"
#include "client/race/files.h"
#include "client/race/flights.h"
#include "client/race/losses.h"
#include "client/race/perceptions.h"
#include "client/race/summary.h"
#include "client/race/tables.h"
#include "client/race/trial_log.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

/// A picture of a lost flight for each cause: of the learned field's flights when it has one.
std::string cause_pictures(const fs::path& folder, const Campaign& campaign, const std::vector<TrialResult>& results) {
  std::string page;
  std::error_code failure;
  for (const Cause cause : kCauses) {
    std::string found;
    for (const bool learned : {true, false})
      for (const TrialResult& result : results) {
        const Cell* cell = campaign.find(result.cell);
        if (!found.empty() || cell == nullptr || result.won() || result.cause != cause) continue;
        if ((cell->perception == Perception::kLearned) != learned) continue;
        const std::string file = "failures/" + Trial{cell, result.speed_m_s, result.seed}.file_name() + "-end.png";
        if (fs::exists(folder / file, failure))
          found = "\nCause **" + std::string(words(cause)) + "**: " + trial_name(result) + "\n\n![" + words(cause) +
                  "](../" + file + ")\n";
      }
    page += found;
  }
  return page;
}

/// Those that the flights of cells with rollouts left.
std::string rollout_pictures(const fs::path& folder, const Campaign& campaign) {
  std::vector<fs::path> files;
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(folder / "rollouts", failure))
    if (entry.path().extension() == ".png") files.push_back(entry.path().filename());
  std::sort(files.begin(), files.end());
  std::string page;
  for (const Cell& cell : campaign.cells)
    if (cell.rollouts)
      for (const fs::path& file : files)
        if (file.string().starts_with(cell.name + "-"))
          page += "\n![" + cell.title + "](../rollouts/" + file.string() + ")\n";
  return page;
}

/// A report while it is written: each part puts its files into the folder and what people read onto the page.
class Writer {
 public:
  Writer(const fs::path& results_folder, const Campaign& campaign, const std::vector<TrialResult>& results)
      : from_(results_folder), campaign_(campaign), results_(results), lines_(summarize(campaign, results)) {
    files_.folder = from_ / "report";
  }

  Result<ReportFiles> write() {
    for (const auto part : {&Writer::tables, &Writer::figures, &Writer::flights})
      if (auto status = (this->*part)(); !status) return status.failure();
    for (const std::string& remark : files_.remarks) page_ += fmt::format("\n- {}", remark);
    if (auto status = put_file(files_.folder / "report.md", page_ + (files_.remarks.empty() ? "" : "\n")); !status)
      return status.failure();
    return std::move(files_);
  }

 private:
  Status put(const std::string& name, const plot::Table& table) const {
    if (auto status = put_file(files_.folder / (name + ".txt"), plot::to_text(table)); !status) return status;
    if (auto status = put_file(files_.folder / (name + ".md"), plot::to_markdown(table)); !status) return status;
    return put_file(files_.folder / (name + ".csv"), plot::to_csv(table));
  }

  /// A table with its title, in files and on the page; nothing when it has no rows.
  Status add(const std::string& name, const plot::Table& table) {
    if (table.rows.empty()) return {};
    if (auto status = put(name, table); !status) return status;
    page_ += fmt::format("\n{}", plot::to_markdown(table));
    return {};
  }

  Status tables() {
    plot::Table success = success_table(campaign_, lines_);
    if (auto status = put("table", success); !status) return status;
    files_.text = plot::to_text(success);
    success.title.clear();
    page_ =
        fmt::format("# {}\n\n{} races. Made by `gatefield-race report`; every race is a line of `trials*.csv`.\n\n{}",
                    campaign_.title, results_.size(), plot::to_markdown(success));

    const plot::Table comparison = comparison_table(campaign_, lines_);
    const plot::Table clearances = clearance_table(campaign_, results_);
    const plot::Table pace = pace_table(campaign_, results_);
    const plot::Table failures = failure_table(lines_);
    const plot::Table perceptions = perception_table(campaign_, results_);
    const plot::Table causes = cause_table(campaign_, lines_, results_);
    if (auto status = add("comparison", comparison); !status) return status;
    if (auto status = add("clearances", clearances); !status) return status;
    if (auto status = add("pace", pace); !status) return status;
    if (auto status = add("failures", failures); !status) return status;
    if (!failures.rows.empty()) page_ += "\n`failures-to-fly.txt` has the command line of each.\n";
    if (auto status = add("perceptions", perceptions); !status) return status;
    if (auto status = add("causes", causes); !status) return status;
    if (!causes.rows.empty()) page_ += cause_pictures(from_, campaign_, results_);
    for (const plot::Table* table : {&comparison, &clearances, &pace, &perceptions, &causes})
      if (!table->rows.empty()) files_.text += fmt::format("\n{}", plot::to_text(*table));

    for (const Line& line : lines_)
      if (line.setups.size() > 1 || line.models.size() > 1)
        files_.remarks.push_back(fmt::format("{} at {:g} m/s mixes trials of different programs, profiles or models",
                                             line.cell, line.speed_m_s));
    return put_file(files_.folder / "failures-to-fly.txt", failure_list(campaign_, results_));
  }

  Status figures() {
    for (const Figure& figure : campaign_.figures) {
      if (auto status = draw(figure.name, success_chart(campaign_, figure, lines_)); !status) return status;
      if (auto status = draw(figure.name + "-failures", failure_chart(campaign_, figure, lines_)); !status)
        return status;
    }
    page_ += rollout_pictures(from_, campaign_);
    return {};
  }

  Status draw(const std::string& name, const plot::Chart& chart) {
    if (chart.series.empty()) return {};
    const auto drawn = plot::draw(chart, files_.folder / "figures", name);
    if (!drawn) return drawn.failure();
    if (drawn->png) page_ += fmt::format("\n![{}](figures/{}.png)\n", chart.title, name);
    if (!drawn->png) files_.remarks.push_back(name + " was not drawn: " + drawn->why_not);
    return {};
  }

  Status flights() {
    for (const Cell& cell : campaign_.cells) {
      if (!has_flights_picture(campaign_, cell)) continue;
      const ShownFlights shown = shown_flights(from_, cell, results_);
      if (shown.flights.empty()) continue;
      const std::string name = cell.name + "-flights.png";
      const std::string subtitle =
          fmt::format("{} flights at a limit of {:g} m/s, {} of them won, each with its own gates (faint); profile {}",
                      shown.flights.size(), shown.speed_m_s, shown.won, cell.profile);
      if (auto status = simulator::write_flights_picture(files_.folder / "figures" / name, cell.scenario, shown.flights,
                                                         cell.title, subtitle);
          !status)
        return status;
      page_ += fmt::format("\n![{}](figures/{})\n", cell.title, name);
    }
    return {};
  }

  const fs::path& from_;
  const Campaign& campaign_;
  const std::vector<TrialResult>& results_;
  const std::vector<Line> lines_;
  ReportFiles files_;
  std::string page_;
};

}  // namespace

Result<ReportFiles> write_report(const fs::path& folder) {
  const auto campaign = load_campaign(folder / "campaign.txt");
  if (!campaign) return campaign.failure();
  const auto results = read_trials(folder);
  if (!results) return results.failure();
  return Writer(folder, *campaign, *results).write();
}

}  // namespace gatefield::race
