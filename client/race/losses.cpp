#include "client/race/losses.h"

#include <fmt/format.h>

#include <numbers>

#include "common/base/text.h"

namespace gatefield::race {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

}  // namespace

plot::Table failure_table(const std::vector<Line>& lines) {
  plot::Table table;
  table.title = "Failures by kind";
  table.columns = {"cell", "speed limit [m/s]", "flown", "lost"};
  for (const Failure failure : kFailures) table.columns.emplace_back(words(failure));
  for (const Line& line : lines) {
    if (line.failures.empty()) continue;
    std::vector<plot::Cell> row{line.cell,
                                {line.speed_m_s, 1},
                                {static_cast<double>(line.trials), 0},
                                {static_cast<double>(line.trials - line.won), 0}};
    for (const Failure failure : kFailures) {
      const auto at = line.failures.find(failure);
      row.emplace_back(at == line.failures.end() ? 0.0 : static_cast<double>(at->second), 0);
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

plot::Table cause_table(const Campaign& campaign, const std::vector<Line>& lines,
                        const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = "Failures by cause";
  table.columns = {"cell", "speed limit [m/s]", "flown", "lost"};
  for (const Cause cause : kCauses) table.columns.emplace_back(words(cause));
  table.columns.insert(table.columns.end(), {"believed off [m]", "believed off [deg]", "seen before the end [s]"});
  for (const Line& line : lines) {
    if (line.causes.empty()) continue;
    const Cell* cell = campaign.find(line.cell);
    std::vector<plot::Cell> row{cell != nullptr ? cell->title : line.cell,
                                {line.speed_m_s, 1},
                                {static_cast<double>(line.trials), 0},
                                {static_cast<double>(line.trials - line.won), 0}};
    for (const Cause cause : kCauses) {
      const auto at = line.causes.find(cause);
      row.emplace_back(at == line.causes.end() ? 0.0 : static_cast<double>(at->second), 0);
    }
    std::vector<double> off_m, off_deg, seen_s;
    for (const TrialResult& result : results)
      if (!result.won() && result.cell == line.cell && result.speed_m_s == line.speed_m_s) {
        off_m.push_back(result.belief_error_m);
        off_deg.push_back(result.belief_turn_deg);
        seen_s.push_back(result.seen_before_s);
      }
    row.emplace_back(median_of(off_m), 2);
    row.emplace_back(median_of(off_deg), 0);
    row.emplace_back(median_of(seen_s), 2);
    table.rows.push_back(std::move(row));
  }
  table.note = fmt::format(
      "Perception wrong: over the last {0:.1f} s the gate was believed more than {1:.1f} m or {2:.0f} deg off, or "
      "another gate was headed for. Seen too late: less than {0:.1f} s before the end. Referee: out of time or "
      "out of the volume. Control: known, and hit or missed all the same. Last columns: medians.",
      kJudged_s, kWrongCenter_m, kWrongAxis_rad * kDegrees);
  return table;
}

std::string failure_list(const Campaign& campaign, const std::vector<TrialResult>& results) {
  std::string out =
      "# Trials that were lost, and how to fly each of them again, bit by bit on the same instruction set.\n"
      "# In this folder's parent, one terminal with the server that the cell names (gatefield-server --model MODEL),\n"
      "# then the line itself; add --picture flight.png --csv run.csv to see what happens.\n";
  for (const TrialResult& result : results) {
    if (result.won()) continue;
    const Cell* cell = campaign.find(result.cell);
    std::string place;
    if (result.end_p_W.allFinite())
      place = fmt::format(", at ({:.2f}, {:.2f}, {:.2f}), frame {}", result.end_p_W.x(), result.end_p_W.y(),
                          result.end_p_W.z(), result.frame);
    if (cell != nullptr && cell->perception != Perception::kLearned) {
      out += "\n# server: gatefield-baseline-server --perception " + std::string(name(cell->perception)) +
             " --scenario cells/" + cell->name + ".txt";
      if (cell->perception == Perception::kTruePose) out += " --world-seed " + std::to_string(result.seed);
    }
    out += "\n# " + trial_name(result) + ": " + words(result.cause) + ", " + words(result.failure) + ": " +
           result.sentence + place + "; model " + (cell != nullptr ? cell->model : "of the cell") + " (hash " +
           hex(result.model) + "), " + result.isa + "\n" + result.reproduce + "\n";
  }
  return out;
}

}  // namespace gatefield::race
