#include "common/plot/chart.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/child_process.h"
#include "common/base/text.h"
#include "common/base/whole_file.h"
#include "common/plot/table.h"

namespace gatefield::plot {
namespace {

// Okabe and Ito's colours, which people with any kind of colour vision can tell apart.
constexpr std::array kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};
constexpr double kBarsWidth = 0.8;  ///< of the distance between two places on the axis, for all series together

std::string number(double value) { return std::isfinite(value) ? text(value) : "NaN"; }

/// A gnuplot string. In single quotes nothing is special but the quote itself; line ends would end the command.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') out += '\'';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "'";
}

std::string label(const Axis& axis) { return axis.unit.empty() ? axis.label : axis.label + " [" + axis.unit + "]"; }

bool plain_name(const std::string& name) {
  return !name.empty() && name.front() != '-' && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
                  c == '-';
         });
}

Status check_axis(const char* name, const Axis& axis) {
  const auto wrong = [&](const std::string& what) { return Error{std::string("chart: axis ") + name + " " + what}; };
  for (const auto& limit : {axis.low, axis.high}) {
    if (!limit) continue;
    if (!std::isfinite(*limit)) return wrong("has a limit that is not finite");
    if (axis.logarithmic && *limit <= 0.0)
      return wrong("is logarithmic and has the limit " + number(*limit) + ", expected one above 0");
  }
  if (axis.low && axis.high && *axis.low >= *axis.high)
    return wrong("goes from " + number(*axis.low) + " to " + number(*axis.high) + ", expected low < high");
  return {};
}

std::string range(const char* axis_name, const Axis& axis) {
  if (!axis.low && !axis.high) return "";
  return std::string("set ") + axis_name + "range [" + (axis.low ? number(*axis.low) : "*") + ":" +
         (axis.high ? number(*axis.high) : "*") + "]\n";
}

std::string axis_commands(const char* axis_name, const Axis& axis) {
  std::string out = std::string("set ") + axis_name + "label " + quoted(label(axis)) + "\n";
  if (axis.logarithmic) out += std::string("set logscale ") + axis_name + "\n";
  out += range(axis_name, axis);
  if (!axis.ticks.empty()) {
    out += std::string("set ") + axis_name + "tics (";
    for (std::size_t i = 0; i < axis.ticks.size(); ++i)
      out += (i == 0 ? "" : ", ") + quoted(axis.ticks[i].second) + " " + number(axis.ticks[i].first);
    out += ")\n";
  }
  return out;
}

const char* key_place(Key key) {
  switch (key) {
    case Key::kTopLeft:
      return "top left";
    case Key::kBottomRight:
      return "bottom right";
    case Key::kBottomLeft:
      return "bottom left";
    case Key::kOutside:
      return "outside right top";
    case Key::kTopRight:
      break;
  }
  return "top right";
}

}  // namespace

Status validate(const Chart& chart) {
  if (chart.width_px < 100 || chart.width_px > 10'000 || chart.height_px < 100 || chart.height_px > 10'000) {
    return Error{"chart: the picture is " + std::to_string(chart.width_px) + " x " + std::to_string(chart.height_px) +
                 " px, expected 100 to 10000 each"};
  }
  if (chart.series.empty() || chart.series.size() > 50)
    return Error{"chart: " + std::to_string(chart.series.size()) + " series, expected 1 to 50"};
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& series = chart.series[i];
    const auto wrong = [&](const std::string& what) {
      return Error{"chart: series " + std::to_string(i) + " ('" + series.name + "') " + what};
    };
    if (series.x.empty()) return wrong("has no points");
    if (series.y.size() != series.x.size())
      return wrong("has " + std::to_string(series.y.size()) + " values of y, expected " +
                   std::to_string(series.x.size()) + " as of x");
    for (const auto* values : {&series.low, &series.high}) {
      if (!values->empty() && values->size() != series.x.size())
        return wrong("has " + std::to_string(values->size()) + " values of low or high, expected none or " +
                     std::to_string(series.x.size()));
    }
    if (series.spread != Spread::kNone && (series.low.empty() || series.high.empty()))
      return wrong("shows a spread and has no low and high");
    if (!std::all_of(series.x.begin(), series.x.end(), [](double x) { return std::isfinite(x); }))
      return wrong("has an x that is not finite");
  }
  if (Status checked = check_axis("x", chart.x); !checked) return checked;
  return check_axis("y", chart.y);
}

std::string to_csv(const Chart& chart) {
  std::string out = "series," + csv_cell(label(chart.x)) + "," + csv_cell(label(chart.y)) + ",low,high\n";
  for (const Series& series : chart.series) {
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      out += csv_cell(series.name) + "," + number(series.x[i]) + "," + number(series.y[i]) + ",";
      if (!series.low.empty()) out += number(series.low[i]);
      out += ",";
      if (!series.high.empty()) out += number(series.high[i]);
      out += "\n";
    }
  }
  return out;
}

std::string to_gnuplot(const Chart& chart, const std::string& csv, const std::string& png) {
  std::string out = "set encoding utf8\nset terminal pngcairo noenhanced size " + std::to_string(chart.width_px) + "," +
                    std::to_string(chart.height_px) +
                    " font 'DejaVu Sans,11' background '#ffffff'\n"
                    "set output " +
                    quoted(png) +
                    "\n"
                    "set datafile separator comma\n"
                    "set title " +
                    quoted(chart.title) +
                    "\n"
                    "set border 3 lc rgb '#505050'\n"
                    "set tics nomirror\n"
                    "set grid back lc rgb '#dddddd' lt 1\n";
  out += std::string("set key ") + key_place(chart.key) + "\n";
  out += axis_commands("x", chart.x) + axis_commands("y", chart.y);
  const auto bars =
      std::count_if(chart.series.begin(), chart.series.end(), [](const Series& s) { return s.style == Style::kBars; });
  const double bar_width = kBarsWidth / static_cast<double>(std::max<std::ptrdiff_t>(1, bars));
  if (bars > 0) out += "set boxwidth " + number(0.92 * bar_width) + "\nset style fill solid 0.85 noborder\n";

  std::vector<std::string> parts;
  std::size_t row = 0;
  std::ptrdiff_t bar = 0;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& series = chart.series[i];
    const std::string rows =
        quoted(csv) + " skip 1 every ::" + std::to_string(row) + "::" + std::to_string(row + series.x.size() - 1) + " ";
    row += series.x.size();
    const std::string color =
        std::string("lc rgb '") +
        kColors[(series.color >= 0 ? static_cast<std::size_t>(series.color) : i) % kColors.size()] + "' ";
    std::string x = "2";
    if (series.style == Style::kBars) {
      x = "($2+" + number(bar_width * (static_cast<double>(bar) - 0.5 * static_cast<double>(bars - 1))) + ")";
      ++bar;
    }
    if (series.spread == Spread::kBand)
      parts.push_back(rows + "using " + x + ":4:5 with filledcurves " + color +
                      "fs transparent solid 0.18 noborder notitle");
    const char* style = series.style == Style::kLine         ? "lines lw 2 "
                        : series.style == Style::kPoints     ? "points pt 7 ps 0.9 "
                        : series.style == Style::kLinePoints ? "linespoints lw 2 pt 7 ps 0.9 "
                                                             : "boxes ";
    parts.push_back(rows + "using " + x + ":3 with " + style + color + (series.dashed ? "dt 2 " : "") +
                    (series.name.empty() ? "notitle" : "title " + quoted(series.name)));
    if (series.spread == Spread::kErrorBars)
      parts.push_back(rows + "using " + x + ":3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 " +
                      (series.style == Style::kBars ? "lc rgb '#303030' " : color) + "notitle");
  }
  out += "plot ";
  for (std::size_t i = 0; i < parts.size(); ++i) out += (i == 0 ? "" : ", \\\n     ") + parts[i];
  return out + "\n";
}

Result<Drawn> draw(const Chart& chart, const std::filesystem::path& folder, const std::string& name,
                   const DrawOptions& options) {
  if (Status checked = validate(chart); !checked) return checked.failure();
  if (!plain_name(name)) return Error{"chart: the name '" + name + "' has other characters than A-Z a-z 0-9 _ . -"};
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  if (code) return Error{folder.string() + " can't be made: " + code.message()};
  Drawn drawn;
  drawn.csv = folder / (name + ".csv");
  drawn.script = folder / (name + ".gp");
  const std::filesystem::path png = folder / (name + ".png");
  if (Status written = write_file(drawn.csv, to_csv(chart)); !written) return written.failure();
  if (Status written = write_file(drawn.script, to_gnuplot(chart, name + ".csv", name + ".png")); !written)
    return written.failure();
  std::filesystem::remove(png, code);  // an old picture must not pass for this one

  // -d: a person's own settings must not change what a report looks like.
  ChildOptions gnuplot;
  gnuplot.arguments = {options.gnuplot, "-d", name + ".gp"};
  gnuplot.folder = folder;
  const auto end = run_child(gnuplot, options.limit);
  std::string why;
  if (!end) {
    why = end.failure().field == "program" ? options.gnuplot + " isn't there (package gnuplot-nox)" : end.error();
  } else if (!end->well()) {
    why = options.gnuplot + " failed: " + end->words;
  } else if (!std::filesystem::exists(png, code)) {
    why = options.gnuplot + " ended well and left no picture";
  } else {
    drawn.png = png;
    return drawn;
  }
  std::filesystem::remove(png, code);
  drawn.why_not = png.string() + " is not drawn: " + why + "; with it, in that folder: gnuplot " + name + ".gp";
  return drawn;
}

}  // namespace gatefield::plot
