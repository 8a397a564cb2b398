#include "client/race/tune/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/race/summary.h"

namespace gatefield::race {
namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }

}  // namespace

std::string trace_csv(const Space& space, const std::vector<Generation>& generations) {
  std::string out = "generation,candidate,score,trials,won,clearance_m,time_s";
  for (const Dimension& d : space.dimensions()) out += "," + d.name;
  out += "\n";
  const auto line = [&](std::size_t generation, const std::string& who, const Score* score, const Point& point) {
    out += fmt::format("{},{},", generation, who);
    out += score == nullptr ? std::string(",,,,")
                            : fmt::format("{},{},{},{},{}", score->mean, score->trials, score->won,
                                          number(score->clearance_m), number(score->time_s));
    for (std::size_t i = 0; i < space.size(); ++i) out += "," + space.value(point, i);
    out += "\n";
  };
  for (std::size_t g = 0; g < generations.size(); ++g) {
    const Generation& generation = generations[g];
    line(g + 1, "base", &generation.base, space.start());
    for (std::size_t i = 0; i < generation.candidates.size(); ++i)
      line(g + 1, fmt::format("c{:02}", i + 1), &generation.candidates[i].score, generation.candidates[i].point);
    line(g + 1, "mean", nullptr, generation.mean);
  }
  return out;
}

plot::Chart trace_chart(const std::string& title, const std::vector<Generation>& generations) {
  plot::Chart chart;
  chart.title = title;
  chart.x = {"generation", ""};
  chart.y = {"score (1 and more: every race won)", "", false, 0.0, 1.55};
  chart.key = plot::Key::kBottomRight;
  plot::Series best{.name = "best candidate"}, middle{.name = "median candidate"}, base{.name = "base, same seeds"};
  for (plot::Series* series : {&best, &middle, &base}) series->style = plot::Style::kLinePoints;
  base.dashed = true;
  for (std::size_t g = 0; g < generations.size(); ++g) {
    std::vector<double> scores;
    for (const Candidate& candidate : generations[g].candidates) scores.push_back(candidate.score.mean);
    for (plot::Series* series : {&best, &middle, &base}) series->x.push_back(static_cast<double>(g + 1));
    best.y.push_back(*std::max_element(scores.begin(), scores.end()));
    middle.y.push_back(median_of(scores));
    base.y.push_back(generations[g].base.mean);
  }
  chart.series = {best, middle, base};
  return chart;
}

}  // namespace gatefield::race
