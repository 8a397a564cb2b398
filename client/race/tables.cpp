#include "client/race/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace gatefield::race {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

const Line* find(const std::vector<Line>& lines, const std::string& cell, double speed_m_s) {
  const auto at = std::find_if(lines.begin(), lines.end(),
                               [&](const Line& line) { return line.cell == cell && line.speed_m_s == speed_m_s; });
  return at == lines.end() ? nullptr : &*at;
}

/// "98 % (93 to 99)"
std::string share_text(const Line& line) {
  const Interval interval = line.interval();
  return fmt::format("{:.0f} % ({:.0f} to {:.0f})", 100 * line.success(), 100 * interval.low, 100 * interval.high);
}

/// "3 target gate's frame, 1 timeout"
std::string failure_text(const Line& line) {
  std::vector<std::pair<std::size_t, Failure>> ordered;
  for (const auto& [failure, count] : line.failures) ordered.emplace_back(count, failure);
  std::stable_sort(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (const auto& [count, failure] : ordered)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + words(failure);
  return text;
}

std::string published_text(const Published& published) {
  const std::string share =
      published.success_percent ? fmt::format("{:g} %", *published.success_percent) : std::string("flown");
  return fmt::format("{} at {:g} m/s", share, published.speed_m_s);
}

}  // namespace

plot::Table success_table(const Campaign& campaign, const std::vector<Line>& lines) {
  plot::Table table;
  table.title = campaign.title;
  table.columns = {"cell",     "profile",         "speed limit [m/s]", "flown",
                   "won",      "success [%]",     "low [%]",           "high [%]",
                   "goal [%]", "top speed [m/s]", "median time [s]",   "clearance [m]",
                   "missed",   "round trip [ms]", "failures"};
  for (const Line& line : lines) {
    const Cell* cell = campaign.find(line.cell);
    const Interval interval = line.interval();
    const bool has_goal = cell != nullptr && cell->goal && cell->goal->speed_m_s == line.speed_m_s;
    const double goal = has_goal ? cell->goal->success_percent : kNone;
    table.rows.push_back({cell != nullptr ? cell->title : line.cell,
                          line.profile,
                          {line.speed_m_s, 1},
                          {static_cast<double>(line.trials), 0},
                          {static_cast<double>(line.won), 0},
                          {100 * line.success(), 0},
                          {100 * interval.low, 0},
                          {100 * interval.high, 0},
                          {goal, 0},
                          {line.top_speed_m_s, 1},
                          {line.median_time_s, 2},
                          {line.smallest_clearance_m, 2},
                          {static_cast<double>(line.won_after_a_miss), 0},
                          {line.median_round_trip_ms, 1},
                          failure_text(line)});
  }
  table.note =
      "low, high: 95 % Wilson interval. Any contact loses. Clearance: the smallest, of hull to frame, in races won. "
      "Missed: races won in which a gate was flown past and then flown again. Round trip: median, wall clock, state "
      "sent to plan received.";
  return table;
}

plot::Table comparison_table(const Campaign& campaign, const std::vector<Line>& lines) {
  plot::Table table;
  table.title = "Beside what others published";
  std::vector<std::string> authors;
  for (const Cell& cell : campaign.cells)
    for (const Published& published : cell.published)
      if (std::find(authors.begin(), authors.end(), published.who) == authors.end()) authors.push_back(published.who);
  table.columns = {"cell"};
  table.columns.insert(table.columns.end(), authors.begin(), authors.end());
  table.columns.insert(table.columns.end(), {"ours", "at limit [m/s]", "top speed [m/s]"});
  for (const Cell& cell : campaign.cells) {
    if (cell.published.empty()) continue;
    const double speed_m_s =
        cell.goal ? cell.goal->speed_m_s : *std::max_element(cell.speeds_m_s.begin(), cell.speeds_m_s.end());
    const Line* line = find(lines, cell.name, speed_m_s);
    if (line == nullptr) continue;
    std::vector<plot::Cell> row{cell.title};
    for (const std::string& author : authors) {
      std::string said;
      for (const Published& published : cell.published)
        if (published.who == author) said += (said.empty() ? "" : ", ") + published_text(published);
      row.emplace_back(said.empty() ? "-" : said);
    }
    row.emplace_back(share_text(*line));
    row.emplace_back(speed_m_s, 1);
    row.emplace_back(line->top_speed_m_s, 1);
    table.rows.push_back(std::move(row));
  }
  table.note = "Others flew in other simulators and with other vehicles: their figures place ours, no more.";
  return table;
}

}  // namespace gatefield::race
