#include "server/training/learn/curves.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "common/plot/chart.h"

namespace gatefield::training {
namespace {

struct Column {
  const char* name;
  const char* says;
};
/// All in metres, so that one axis holds them.
constexpr Column kColumns[] = {{"constant_m", "field, the best constant's"},
                               {"field_m", "field"},
                               {"box_m", "field within 1.2 m of the centre"},
                               {"center_m", "centre, per axis"},
                               {"first_center_m", "centre after the first look, per axis"}};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  return out;
}

}  // namespace

Result<std::string> draw_curves(const std::filesystem::path& log_file, const std::filesystem::path& folder,
                                const std::string& name) {
  std::ifstream in(log_file);
  if (!in) return Error{"log " + log_file.string() + " can't be read"};
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> header = split(line);
  const auto column = [&](const std::string& wanted) {
    return static_cast<std::size_t>(std::find(header.begin(), header.end(), wanted) - header.begin());
  };
  std::vector<std::vector<double>> rows;
  while (std::getline(in, line)) {
    std::vector<double> row;
    for (const std::string& cell : split(line)) row.push_back(std::strtod(cell.c_str(), nullptr));
    if (row.size() != header.size())
      return Error{"log " + log_file.string() + ": line " + std::to_string(rows.size() + 2) + " has " +
                   std::to_string(row.size()) + " cells, expected " + std::to_string(header.size())};
    rows.push_back(std::move(row));
  }
  if (column("images") == header.size() || rows.empty())
    return Error{"log " + log_file.string() + " is no training log with lines"};

  plot::Chart chart;
  chart.title = "Training " + log_file.parent_path().filename().string();
  chart.x = {.label = "image passes", .unit = ""};
  chart.y = {.label = "mean absolute error", .unit = "m", .logarithmic = true};
  // A few hundred points are all that a picture shows; each is a mean.
  const std::size_t bunch = rows.size() / 300 + 1;
  for (const Column& wanted : kColumns) {
    const std::size_t at = column(wanted.name);
    if (at == header.size()) continue;
    plot::Series series;
    series.name = wanted.says;
    series.dashed = std::string(wanted.name) == "constant_m";
    for (std::size_t i = 0; i < rows.size(); i += bunch) {
      const std::size_t end = std::min(rows.size(), i + bunch);
      double sum = 0.0;
      for (std::size_t k = i; k < end; ++k) sum += rows[k][at];
      const double mean = sum / static_cast<double>(end - i);
      if (mean <= 0.0) continue;  // not part of this design
      series.x.push_back(rows[end - 1][column("images")]);
      series.y.push_back(mean);
    }
    if (!series.x.empty()) chart.series.push_back(std::move(series));
  }
  const auto drawn = plot::draw(chart, folder, name);
  if (!drawn) return drawn.failure();
  return drawn->why_not;
}

}  // namespace gatefield::training
