#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"

/// Curves for reports, drawn by gnuplot: what is plotted also lies beside the picture as CSV and as a script that a
/// person can change and run again.
namespace gatefield::plot {

struct Axis {
  std::string label = {};
  std::string unit = {};  ///< shown in brackets; empty = none
  bool logarithmic = false;
  std::optional<double> low = {}, high = {};               ///< empty = from the data
  std::vector<std::pair<double, std::string>> ticks = {};  ///< empty = numbers; else these places with these names
};

enum class Style { kLine, kPoints, kLinePoints, kBars };
/// How `low` and `high` of a series are shown.
enum class Spread { kNone, kErrorBars, kBand };

struct Series {
  std::string name = {};  ///< in the key; empty = not there
  std::vector<double> x = {}, y = {};
  std::vector<double> low = {}, high = {};  ///< as many as y, or none; absolute values, not distances from y
  Style style = Style::kLine;
  Spread spread = Spread::kNone;
  bool dashed = false;
  int color = -1;  ///< 0 to 6 of the palette, for series that belong together; -1: by its place
};

/// Where the series' names stand.
enum class Key { kTopRight, kTopLeft, kBottomRight, kBottomLeft, kOutside };

struct Chart {
  std::string title = {};
  Axis x = {}, y = {};
  std::vector<Series> series = {};  ///< bars of several series stand side by side
  Key key = Key::kTopRight;
  int width_px = 960;
  int height_px = 600;
};

/// Says which series or field is wrong and why: sizes of x, y, low and high match, a spread has low and high, x is
/// finite (other values may be NaN: a gap), limits are finite with low < high, positive on a logarithmic axis, picture
/// 100 to 10000 px, 1 to 50 series with a point at least.
Status validate(const Chart& chart);

/// One line a point: series,x,y,low,high, with a header that carries the axes' labels and units.
std::string to_csv(const Chart& chart);
/// The script that draws `csv` into `png`, both names of files in the folder where gnuplot runs.
/// @pre validate(chart).ok(), names of [A-Za-z0-9_.-]
std::string to_gnuplot(const Chart& chart, const std::string& csv, const std::string& png);

struct DrawOptions {
  std::string gnuplot = "gnuplot";  ///< looked for on the PATH
  std::chrono::milliseconds limit{30'000};
};

struct Drawn {
  std::filesystem::path csv, script;
  std::optional<std::filesystem::path> png;  ///< empty: not drawn
  std::string why_not;                       ///< a sentence then
};

/// Writes <folder>/<name>.csv and .gp and has gnuplot draw <name>.png. A gnuplot that is missing, fails or takes longer
/// than the limit is no error: the two files stay, and `why_not` says what to do. No shell is involved.
/// Errors: a chart that isn't valid, a name other than [A-Za-z0-9_.-], a file that can't be written.
/// Thread-safe: yes (other names).   Real-time safe: no.
Result<Drawn> draw(const Chart& chart, const std::filesystem::path& folder, const std::string& name,
                   const DrawOptions& options = {});

}  // namespace gatefield::plot
