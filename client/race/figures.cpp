#include "client/race/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace gatefield::race {
namespace {

constexpr std::size_t kMaxSeries = 50;

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

}  // namespace

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
      name += fmt::format(", {:g} m/s", line.speed_m_s);
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
  if (chart.series.size() > kMaxSeries) chart.series.resize(kMaxSeries);
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
    series.name = fmt::format("{}, {:g} m/s", cell->title, line.speed_m_s);
    series.style = plot::Style::kBars;
    for (std::size_t i = 0; i < std::size(kFailures); ++i) {
      const auto at = line.failures.find(kFailures[i]);
      const double count = at == line.failures.end() ? 0.0 : static_cast<double>(at->second);
      series.x.push_back(static_cast<double>(i));
      series.y.push_back(100.0 * count / static_cast<double>(line.trials));
    }
    chart.series.push_back(std::move(series));
  }
  if (chart.series.size() > kMaxSeries) chart.series.resize(kMaxSeries);
  return chart;
}

}  // namespace gatefield::race
