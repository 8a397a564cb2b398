#include "client/race/flights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <utility>

#include "common/base/whole_file.h"

namespace gatefield::race {
namespace {

namespace fs = std::filesystem;

constexpr double kPathStep_s = 0.04;

Result<simulator::FlownPath> read_path(const fs::path& file, const TrialResult& result) {
  const auto text = read_file(file);
  if (!text) return text.failure();
  simulator::FlownPath path{result.seed, result.won(), {}};
  std::istringstream in(*text);
  std::string line;
  std::getline(in, line);  // the header
  while (std::getline(in, line)) {
    simulator::FlownPath::Point point;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf,%lf", &point.t_s, &point.p_W.x(), &point.p_W.y(), &point.p_W.z(),
                    &point.speed_m_s) != 5)
      return Error{"can't be read as t_s,x_m,y_m,z_m,speed_m_s", ErrorCode::kUnreadable}.at(file.string());
    path.points.push_back(point);
  }
  return path;
}

}  // namespace

std::string path_text(const simulator::Report& report) {
  std::string text = "t_s,x_m,y_m,z_m,speed_m_s\n";
  double next_s = 0.0;
  for (std::size_t i = 0; i < report.samples.size(); ++i) {
    const auto& sample = report.samples[i];
    if (sample.t_s < next_s - 1e-9 && i + 1 < report.samples.size()) continue;
    next_s = sample.t_s + kPathStep_s;
    text += fmt::format("{:.3f},{:.4f},{:.4f},{:.4f},{:.3f}\n", sample.t_s, sample.state.p_WB.x(),
                        sample.state.p_WB.y(), sample.state.p_WB.z(), sample.state.v_WB.norm());
  }
  return text;
}

ShownFlights shown_flights(const fs::path& folder, const Cell& cell, const std::vector<TrialResult>& results) {
  std::vector<double> speeds = cell.speeds_m_s;
  std::sort(speeds.rbegin(), speeds.rend());
  if (cell.goal) speeds.insert(speeds.begin(), cell.goal->speed_m_s);
  for (const double speed_m_s : speeds) {
    ShownFlights shown{speed_m_s, {}, 0};
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

bool has_flights_picture(const Campaign& campaign, const Cell& cell) {
  const auto figure = std::find_if(campaign.figures.begin(), campaign.figures.end(),
                                   [&](const Figure& each) { return each.name == cell.figure; });
  const bool against_link =
      figure != campaign.figures.end() &&
      (figure->against == Against::kDelay || figure->against == Against::kJitter || figure->against == Against::kLoss);
  return cell.beside.empty() && !against_link;
}

}  // namespace gatefield::race
