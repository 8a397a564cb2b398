#include "client/race/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>

#include "client/race/files.h"
#include "client/race/trial_log.h"
#include "client/simulator/flight_picture.h"
#include "common/base/text.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostSeries = 50;
constexpr double kPathStep_s = 0.04;

std::string number(double value, const char* format = "%g") {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

double median(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNone;
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

const Line* find(const std::vector<Line>& lines, const std::string& cell, double speed_m_s) {
  const auto at = std::find_if(lines.begin(), lines.end(),
                               [&](const Line& line) { return line.cell == cell && line.speed_m_s == speed_m_s; });
  return at == lines.end() ? nullptr : &*at;
}

/// "98 % (93 to 99)"
std::string share_text(const Line& line) {
  const Interval interval = line.interval();
  return number(100 * line.success(), "%.0f") + " % (" + number(100 * interval.low, "%.0f") + " to " +
         number(100 * interval.high, "%.0f") + ")";
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

const char* label(Against against) {
  switch (against) {
    case Against::kSpeed:
      return "speed limit";
    case Against::kDelay:
      return "link delay each way";
    case Against::kJitter:
      return "link jitter";
    case Against::kLoss:
      return "messages lost, each way";
    case Against::kPosition:
      return "gates displaced by";
    case Against::kYaw:
      return "gates turned by up to";
    case Against::kTilt:
      return "gates leant by up to";
  }
  return "";
}

const char* unit(Against against) {
  switch (against) {
    case Against::kSpeed:
      return "m/s";
    case Against::kDelay:
    case Against::kJitter:
      return "ms";
    case Against::kLoss:
      return "%";
    case Against::kPosition:
      return "m";
    case Against::kYaw:
    case Against::kTilt:
      return "deg";
  }
  return "";
}

std::string published_text(const Published& published) {
  return (published.success_percent ? number(*published.success_percent) + " %" : std::string("flown")) + " at " +
         number(published.speed_m_s) + " m/s";
}

Status put_table(const fs::path& folder, const std::string& name, const plot::Table& table) {
  if (auto status = put_file(folder / (name + ".txt"), plot::to_text(table)); !status) return status;
  if (auto status = put_file(folder / (name + ".md"), plot::to_markdown(table)); !status) return status;
  return put_file(folder / (name + ".csv"), plot::to_csv(table));
}

Result<simulator::FlownPath> read_path(const fs::path& file, const TrialResult& result) {
  const auto text = read_file(file);
  if (!text) return Error{text.error()};
  simulator::FlownPath path{result.seed, result.won(), {}};
  std::istringstream in(*text);
  std::string line;
  std::getline(in, line);  // the header
  while (std::getline(in, line)) {
    simulator::FlownPath::Point point;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf", &point.t_s, &point.p_W.x(), &point.p_W.y(), &point.p_W.z(),
                    &point.speed_m_s) != 5)
      return Error{file.string() + ": can't be read as t_s,x_m,y_m,z_m,speed_m_s"};
    path.points.push_back(point);
  }
  return path;
}

/// The flights of a cell at its goal, else at the highest speed with flights to show.
struct Shown {
  double speed_m_s = 0.0;
  std::vector<simulator::FlownPath> flights;
  std::size_t won = 0;
};
Shown flights_of(const fs::path& folder, const Cell& cell, const std::vector<TrialResult>& results) {
  std::vector<double> speeds = cell.speeds_m_s;
  std::sort(speeds.rbegin(), speeds.rend());
  if (cell.goal) speeds.insert(speeds.begin(), cell.goal->speed_m_s);
  for (const double speed_m_s : speeds) {
    Shown shown{speed_m_s, {}, 0};
    for (const TrialResult& result : results) {
      if (result.cell != cell.name || result.speed_m_s != speed_m_s) continue;
      const Trial trial{&cell, speed_m_s, result.seed};
      std::error_code failure;
      const fs::path file = folder / "paths" / (trial.file_name() + ".csv");
      if (!fs::exists(file, failure)) continue;
      if (auto path = read_path(file, result)) {
        shown.won += path->won;
        shown.flights.push_back(std::move(path).value());
      }
    }
    if (!shown.flights.empty()) return shown;
  }
  return {};
}

/// Flights over another link, or with other eyes, look like those of the cell that they are compared with.
bool has_flights_picture(const Campaign& campaign, const Cell& cell) {
  const auto figure = std::find_if(campaign.figures.begin(), campaign.figures.end(),
                                   [&](const Figure& each) { return each.name == cell.figure; });
  const bool against_link =
      figure != campaign.figures.end() &&
      (figure->against == Against::kDelay || figure->against == Against::kJitter || figure->against == Against::kLoss);
  return cell.beside.empty() && !against_link;
}

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

}  // namespace

Interval wilson(std::size_t won, std::size_t trials) noexcept {
  if (trials == 0) return {};
  constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
  const auto n = static_cast<double>(trials);
  const double p = static_cast<double>(won) / n;
  const double middle = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n);
  // None won or all won: the formula gives the border itself, but for rounding.
  return {won == 0 ? 0.0 : middle - half, won == trials ? 1.0 : middle + half};
}

std::vector<Line> summarize(const Campaign& campaign, const std::vector<TrialResult>& results) {
  std::vector<Line> lines;
  const auto line_of = [&](const std::string& cell, double speed_m_s) -> Line& {
    for (Line& line : lines)
      if (line.cell == cell && line.speed_m_s == speed_m_s) return line;
    lines.push_back({});
    lines.back().cell = cell;
    lines.back().speed_m_s = speed_m_s;
    return lines.back();
  };
  for (const Cell& cell : campaign.cells)
    for (const double speed_m_s : cell.speeds_m_s) line_of(cell.name, speed_m_s).profile = cell.profile;
  std::map<std::pair<std::string, double>, std::array<std::vector<double>, 3>> values;
  for (const TrialResult& result : results) {
    Line& line = line_of(result.cell, result.speed_m_s);
    line.profile = result.profile;
    ++line.trials;
    if (result.won()) ++line.won;
    if (!result.won()) ++line.failures[result.failure];
    if (!result.won()) ++line.causes[result.cause];
    if (std::isfinite(result.top_speed_m_s)) line.top_speed_m_s = std::max(line.top_speed_m_s, result.top_speed_m_s);
    line.setups.insert(result.setup);
    line.models.insert(result.model);
    auto& [times, clearances, trips] = values[{line.cell, line.speed_m_s}];
    if (result.won()) times.push_back(result.time_s);
    if (result.won()) clearances.push_back(result.clearance_m);
    if (result.failure != Failure::kLostServer) trips.push_back(result.round_trip_p50_ms);
  }
  for (Line& line : lines) {
    auto& [times, clearances, trips] = values[{line.cell, line.speed_m_s}];
    line.median_time_s = median(times);
    std::erase_if(clearances, [](double v) { return !std::isfinite(v); });
    line.smallest_clearance_m = clearances.empty() ? kNone : *std::min_element(clearances.begin(), clearances.end());
    line.median_round_trip_ms = median(trips);
  }
  std::erase_if(lines, [](const Line& line) { return line.trials == 0; });
  return lines;
}

plot::Table success_table(const Campaign& campaign, const std::vector<Line>& lines) {
  plot::Table table;
  table.title = campaign.title;
  table.columns = {
      "cell",     "profile",  "speed limit [m/s]", "flown",           "won",           "success [%]",     "low [%]",
      "high [%]", "goal [%]", "top speed [m/s]",   "median time [s]", "clearance [m]", "round trip [ms]", "failures"};
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
                          {line.median_round_trip_ms, 1},
                          failure_text(line)});
  }
  table.note =
      "low, high: 95 % Wilson interval. Any contact loses. Clearance: the smallest, of hull to frame, in races won. "
      "Round trip: median, wall clock, state sent to plan received.";
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
    row.emplace_back(median(off_m), 2);
    row.emplace_back(median(off_deg), 0);
    row.emplace_back(median(seen_s), 2);
    table.rows.push_back(std::move(row));
  }
  char note[400];
  std::snprintf(note, sizeof note,
                "Perception wrong: over the last %.1f s the gate was believed more than %.1f m or %.0f deg off, or "
                "another gate was headed for. Seen too late: less than %.1f s before the end. Referee: out of time or "
                "out of the volume. Control: known, and hit or missed all the same. Last columns: medians.",
                kJudged_s, kWrongCenter_m, kWrongAxis_rad * 57.29577951308232, kJudged_s);
  table.note = note;
  return table;
}

plot::Table perception_table(const Campaign& campaign, const std::vector<TrialResult>& results) {
  plot::Table table;
  table.title = "Perceptions beside each other, same seeds";
  table.columns = {"cell", "speed limit [m/s]", "seeds"};
  for (const Perception perception : kPerceptions) table.columns.push_back(std::string(words(perception)) + " [%]");
  table.columns.insert(table.columns.end(), {"lost, won with the true pose", "lost with both"});
  for (const Cell& base : campaign.cells) {
    std::vector<const Cell*> cells{&base};
    for (const Cell& cell : campaign.cells)
      if (cell.beside == base.name) cells.push_back(&cell);
    if (cells.size() < 2) continue;
    for (const double speed_m_s : base.speeds_m_s) {
      // By cell: what became of each seed. Those count that every cell with this speed has flown.
      std::vector<std::map<std::uint64_t, bool>> won;
      std::vector<const Cell*> flown;
      for (const Cell* cell : cells) {
        std::map<std::uint64_t, bool> seeds;
        for (const TrialResult& result : results)
          if (result.cell == cell->name && result.speed_m_s == speed_m_s && result.failure != Failure::kLostServer)
            seeds[result.seed] = result.won();
        if (seeds.empty()) continue;
        won.push_back(std::move(seeds));
        flown.push_back(cell);
      }
      if (flown.size() < 2 || flown.front() != &base) continue;
      std::vector<std::uint64_t> common;
      for (const auto& [seed, unused] : won.front())
        if (std::all_of(won.begin(), won.end(), [s = seed](const auto& seeds) { return seeds.count(s) > 0; }))
          common.push_back(seed);
      if (common.empty()) continue;
      std::vector<plot::Cell> row{base.title, {speed_m_s, 1}, {static_cast<double>(common.size()), 0}};
      const std::map<std::uint64_t, bool>*learned = nullptr, *truth = nullptr;
      for (const Perception perception : kPerceptions) {
        double share = kNone;
        for (std::size_t i = 0; i < flown.size(); ++i) {
          if (flown[i]->perception != perception) continue;
          const auto count =
              std::count_if(common.begin(), common.end(), [&](std::uint64_t seed) { return won[i].at(seed); });
          share = 100.0 * static_cast<double>(count) / static_cast<double>(common.size());
          if (perception == Perception::kLearned) learned = &won[i];
          if (perception == Perception::kTruePose) truth = &won[i];
        }
        row.emplace_back(share, 0);
      }
      double perceptions = kNone, both = kNone;
      if (learned != nullptr && truth != nullptr) {
        const auto count = [&](bool with_truth) {
          return static_cast<double>(std::count_if(common.begin(), common.end(), [&](std::uint64_t seed) {
            return !learned->at(seed) && truth->at(seed) == with_truth;
          }));
        };
        perceptions = count(true);
        both = count(false);
      }
      row.emplace_back(perceptions, 0);
      row.emplace_back(both, 0);
      table.rows.push_back(std::move(row));
    }
  }
  table.note =
      "Same planner, profile, seeds and gates; only what sees the gates differs. Lost, won with the true pose: "
      "perception's share of the learned field's losses; lost with both: control's.";
  return table;
}

plot::Chart success_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines) {
  plot::Chart chart;
  chart.title = figure.title.empty() ? campaign.title + ": " + figure.name : figure.title;
  chart.x = {label(figure.against), unit(figure.against)};
  chart.y = {"races won", "%", false, 0.0, 105.0};
  chart.key = plot::Key::kOutside;
  chart.width_px = 1200;
  const auto series_of = [&](const std::string& name) -> plot::Series& {
    for (plot::Series& series : chart.series)
      if (series.name == name) return series;
    chart.series.push_back({});
    chart.series.back().name = name;
    return chart.series.back();
  };
  struct Point {
    double x, y, low, high;
  };
  std::map<std::string, std::vector<Point>> points;
  for (const Line& line : lines) {
    const Cell* cell = campaign.find(line.cell);
    if (cell == nullptr || cell->figure != figure.name) continue;
    // One speed is no curve: what other eyes see at one speed stands in the table of perceptions.
    if (!cell->beside.empty() && cell->speeds_m_s.size() == 1 && figure.against == Against::kSpeed) continue;
    std::string name = cell->series;
    if (figure.against != Against::kSpeed && cell->speeds_m_s.size() > 1)
      name += ", " + number(line.speed_m_s) + " m/s";
    plot::Series& series = series_of(name);
    series.style = plot::Style::kLinePoints;
    series.spread = plot::Spread::kErrorBars;
    const Interval interval = line.interval();
    points[name].push_back({abscissa(*cell, line.speed_m_s, figure.against), 100 * line.success(), 100 * interval.low,
                            100 * interval.high});
  }
  for (plot::Series& series : chart.series) {
    auto& own = points[series.name];
    std::stable_sort(own.begin(), own.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
    for (const Point& point : own) {
      series.x.push_back(point.x);
      series.y.push_back(point.y);
      series.low.push_back(point.low);
      series.high.push_back(point.high);
    }
  }
  if (figure.against == Against::kSpeed && !chart.series.empty())
    for (const Cell& cell : campaign.cells)
      for (const Published& published : cell.published) {
        if (cell.figure != figure.name || !published.success_percent) continue;
        plot::Series& series = series_of(published.who + ": " + cell.series);
        series.style = plot::Style::kPoints;
        series.x.push_back(published.speed_m_s);
        series.y.push_back(*published.success_percent);
      }
  if (chart.series.size() > kMostSeries) chart.series.resize(kMostSeries);
  // Room beside the outermost points, whose intervals would lie on the frame.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const plot::Series& series : chart.series)
    for (const double x : series.x) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  const double room = high > low ? 0.05 * (high - low) : std::max(0.1, 0.1 * std::abs(high));
  if (!chart.series.empty()) {
    chart.x.low = low - room;
    chart.x.high = high + room;
  }
  return chart;
}

plot::Chart failure_chart(const Campaign& campaign, const Figure& figure, const std::vector<Line>& lines) {
  plot::Chart chart;
  chart.title = "Races lost, by kind: " + (figure.title.empty() ? figure.name : figure.title);
  chart.x = {"why"};
  for (std::size_t i = 0; i < std::size(kFailures); ++i)
    chart.x.ticks.emplace_back(static_cast<double>(i), words(kFailures[i]));
  chart.x.low = -0.6;
  chart.x.high = static_cast<double>(std::size(kFailures)) - 0.4;
  chart.y = {"share of the races flown", "%", false, 0.0};
  chart.key = plot::Key::kOutside;
  chart.width_px = 1500;
  for (const Line& line : lines) {
    const Cell* cell = campaign.find(line.cell);
    if (cell == nullptr || cell->figure != figure.name || line.failures.empty()) continue;
    plot::Series series;
    series.name = cell->title + ", " + number(line.speed_m_s) + " m/s";
    series.style = plot::Style::kBars;
    for (std::size_t i = 0; i < std::size(kFailures); ++i) {
      const auto at = line.failures.find(kFailures[i]);
      const double count = at == line.failures.end() ? 0.0 : static_cast<double>(at->second);
      series.x.push_back(static_cast<double>(i));
      series.y.push_back(100.0 * count / static_cast<double>(line.trials));
    }
    chart.series.push_back(std::move(series));
  }
  if (chart.series.size() > kMostSeries) chart.series.resize(kMostSeries);
  return chart;
}

std::string failure_list(const Campaign& campaign, const std::vector<TrialResult>& results) {
  std::string out =
      "# Trials that were lost, and how to fly each of them again, bit by bit on the same instruction set.\n"
      "# In this folder's parent, one terminal with the server that the cell names (gatefield-server --model MODEL),\n"
      "# then the line itself; add --picture flight.png --csv run.csv to see what happens.\n";
  for (const TrialResult& result : results) {
    if (result.won()) continue;
    const Cell* cell = campaign.find(result.cell);
    char place[96] = "";
    if (result.end_p_W.allFinite())
      std::snprintf(place, sizeof place, ", at (%.2f, %.2f, %.2f), frame %llu", result.end_p_W.x(), result.end_p_W.y(),
                    result.end_p_W.z(), static_cast<unsigned long long>(result.frame));
    if (cell != nullptr && cell->perception != Perception::kLearned)
      out += "\n# server: gatefield-baseline-server --perception " + std::string(name(cell->perception)) +
             " --scenario cells/" + cell->name + ".txt";
    out += "\n# " + trial_name(result) + ": " + words(result.cause) + ", " + words(result.failure) + ": " +
           result.sentence + place + "; model " + (cell != nullptr ? cell->model : "of the cell") + " (hash " +
           hex(result.model) + "), " + result.isa + "\n" + result.reproduce + "\n";
  }
  return out;
}

std::string path_text(const simulator::Report& report) {
  std::string text = "t_s,x_m,y_m,z_m,speed_m_s\n";
  double next_s = 0.0;
  for (std::size_t i = 0; i < report.samples.size(); ++i) {
    const auto& sample = report.samples[i];
    if (sample.t_s < next_s - 1e-9 && i + 1 < report.samples.size()) continue;
    next_s = sample.t_s + kPathStep_s;
    char line[128];
    std::snprintf(line, sizeof line, "%.3f,%.4f,%.4f,%.4f,%.3f\n", sample.t_s, sample.state.p_WB.x(),
                  sample.state.p_WB.y(), sample.state.p_WB.z(), sample.state.v_WB.norm());
    text += line;
  }
  return text;
}

Result<ReportFiles> write_report(const fs::path& folder) {
  const auto campaign = load_campaign(folder / "campaign.txt");
  if (!campaign) return Error{campaign.error()};
  const auto results = read_trials(folder);
  if (!results) return Error{results.error()};
  const std::vector<Line> lines = summarize(*campaign, *results);
  ReportFiles out;
  out.folder = folder / "report";

  const plot::Table success = success_table(*campaign, lines);
  const plot::Table comparison = comparison_table(*campaign, lines);
  const plot::Table failures = failure_table(lines);
  std::string page = "# " + campaign->title + "\n\n" + std::to_string(results->size()) +
                     " races. Made by `gatefield-race report`; every race is a line of `trials*.csv`.\n\n";
  plot::Table untitled = success;
  untitled.title.clear();
  page += plot::to_markdown(untitled);
  out.text = plot::to_text(success);
  if (auto status = put_table(out.folder, "table", success); !status) return Error{status.error()};
  if (!comparison.rows.empty()) {
    if (auto status = put_table(out.folder, "comparison", comparison); !status) return Error{status.error()};
    page += "\n" + plot::to_markdown(comparison);
    out.text += "\n" + plot::to_text(comparison);
  }
  if (!failures.rows.empty()) {
    if (auto status = put_table(out.folder, "failures", failures); !status) return Error{status.error()};
    page += "\n" + plot::to_markdown(failures) + "\n`failures-to-fly.txt` has the command line of each.\n";
  }
  const plot::Table perceptions = perception_table(*campaign, *results);
  if (!perceptions.rows.empty()) {
    if (auto status = put_table(out.folder, "perceptions", perceptions); !status) return Error{status.error()};
    page += "\n" + plot::to_markdown(perceptions);
    out.text += "\n" + plot::to_text(perceptions);
  }
  const plot::Table causes = cause_table(*campaign, lines, *results);
  if (!causes.rows.empty()) {
    if (auto status = put_table(out.folder, "causes", causes); !status) return Error{status.error()};
    page += "\n" + plot::to_markdown(causes);
    out.text += "\n" + plot::to_text(causes);
    page += cause_pictures(folder, *campaign, *results);
  }
  if (auto status = put_file(out.folder / "failures-to-fly.txt", failure_list(*campaign, *results)); !status)
    return Error{status.error()};

  for (const Line& line : lines)
    if (line.setups.size() > 1 || line.models.size() > 1)
      out.remarks.push_back(line.cell + " at " + number(line.speed_m_s) +
                            " m/s mixes trials of different programs, profiles or models");

  const fs::path figures = out.folder / "figures";
  for (const Figure& figure : campaign->figures)
    for (const auto& [name, chart] : {std::pair(figure.name, success_chart(*campaign, figure, lines)),
                                      std::pair(figure.name + "-failures", failure_chart(*campaign, figure, lines))}) {
      if (chart.series.empty()) continue;
      const auto drawn = plot::draw(chart, figures, name);
      if (!drawn) return Error{drawn.error()};
      if (drawn->png) page += "\n![" + chart.title + "](figures/" + name + ".png)\n";
      if (!drawn->png) out.remarks.push_back(name + " was not drawn: " + drawn->why_not);
    }
  page += rollout_pictures(folder, *campaign);
  for (const Cell& cell : campaign->cells) {
    if (!has_flights_picture(*campaign, cell)) continue;
    const Shown shown = flights_of(folder, cell, *results);
    if (shown.flights.empty()) continue;
    const std::string name = cell.name + "-flights.png";
    const std::string subtitle = std::to_string(shown.flights.size()) + " flights at a limit of " +
                                 number(shown.speed_m_s) + " m/s, " + std::to_string(shown.won) +
                                 " of them won, each with its own gates (faint); profile " + cell.profile;
    if (auto status =
            simulator::write_flights_picture(figures / name, cell.scenario, shown.flights, cell.title, subtitle);
        !status)
      return Error{status.error()};
    page += "\n![" + cell.title + "](figures/" + name + ")\n";
  }
  for (const std::string& remark : out.remarks) page += "\n- " + remark;
  if (auto status = put_file(out.folder / "report.md", page + (out.remarks.empty() ? "" : "\n")); !status)
    return Error{status.error()};
  return out;
}

}  // namespace gatefield::race
