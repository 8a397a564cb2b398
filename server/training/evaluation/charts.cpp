#include "server/training/evaluation/charts.h"

#include <algorithm>
#include <cmath>

#include "common/base/statistics.h"
#include "server/training/evaluation/selection.h"

namespace gatefield::training {
namespace {

using plot::Chart;
using plot::Key;
using plot::Series;
using plot::Spread;
using plot::Style;

constexpr double kBin_m = 0.5;
constexpr int kBins = 20;
constexpr std::size_t kFewInBin = 10;  ///< bins with fewer frames are left out of curves

int color_of(Mode mode) { return static_cast<int>(index_of(mode)); }

/// Letters, digits, '_', '.' and '-'; everything else becomes '-'.
std::string file_name(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' || c == '-';
    out += plain ? c : '-';
  }
  return out;
}

Chart roc_chart(const Evaluation::Set& set) {
  Chart chart;
  chart.title = "Validity: gates kept and empty frames taken for gates, " + set.name;
  chart.x.label = "of the empty ones, taken for a gate";
  chart.x.logarithmic = true;
  chart.x.low = 1e-3;
  chart.x.high = 1.0;
  chart.y.label = "of the gates, kept";
  chart.y.low = 0.7;
  chart.y.high = 1.0;
  chart.key = Key::kBottomRight;
  const auto add = [&](const char* name, Empty empty) {
    Series series{.name = name, .style = Style::kLine};
    const std::vector<RocPoint> curve = validity_curve(set.frames, 0, empty);
    for (const RocPoint& point : curve) {
      // Smaller steps can't be seen; both ends stay.
      if (!series.x.empty() && &point != &curve.back() && point.false_alarms < 1.03 * series.x.back() &&
          point.kept - series.y.back() < 2e-3)
        continue;
      series.x.push_back(point.false_alarms);
      series.y.push_back(point.kept);
    }
    if (!series.x.empty()) chart.series.push_back(std::move(series));
  };
  add("first look: nothing of any gate in view", Empty::kNothing);
  add("first look: no valid gate in view", Empty::kNoValid);
  add("prior: a place without a gate", Empty::kPlaces);
  return chart;
}

Chart calibration_chart(const Evaluation::Set& set) {
  Chart chart;
  chart.title = "Predicted and actual error, " + set.name + " (medians; bars: 10th to 90th percentile)";
  chart.x = {.label = "predicted error", .unit = "m", .logarithmic = true};
  chart.y = {.label = "actual error within 1 m of the gate", .unit = "m", .logarithmic = true};
  chart.key = Key::kTopLeft;
  double least = 1.0, most = 0.0;
  for (const Mode mode : kModes) {
    const Predictions p = predictions(set.frames, 0, mode);
    Series series{.name = name_of(mode), .style = Style::kLinePoints, .spread = Spread::kErrorBars};
    for (const CalibrationBin& bin : calibrate(p.predicted_m, p.actual_m, kBins)) {
      series.x.push_back(bin.predicted_m);
      series.y.push_back(bin.actual_median_m);
      series.low.push_back(bin.actual_p10_m);
      series.high.push_back(bin.actual_p90_m);
      least = std::min({least, bin.predicted_m, bin.actual_median_m});
      most = std::max({most, bin.predicted_m, bin.actual_median_m});
    }
    if (!series.x.empty()) chart.series.push_back(std::move(series));
  }
  if (most > least && least > 0.0)
    chart.series.push_back(
        {.name = "as predicted", .x = {least, most}, .y = {least, most}, .dashed = true, .color = 6});
  return chart;
}

Chart risk_chart(const Evaluation::Set& set) {
  Chart chart;
  chart.title = "What is left when the worst predicted frames are given up, " + set.name;
  chart.x = {.label = "frames kept", .unit = "%"};
  chart.y = {.label = "mean error within 1 m of the gate", .unit = "m"};
  chart.y.low = 0.0;
  chart.key = Key::kTopLeft;
  for (const Mode mode : kModes) {
    const Predictions p = predictions(set.frames, 0, mode);
    Series kept{.name = name_of(mode), .color = color_of(mode)};
    Series best{
        .name = std::string(name_of(mode)) + ", if the errors were known", .dashed = true, .color = color_of(mode)};
    for (const RiskPoint& point : risk_coverage(p.predicted_m, p.actual_m, 100)) {
      for (Series* series : {&kept, &best}) series->x.push_back(100.0 * point.coverage);
      kept.y.push_back(point.mean_m);
      best.y.push_back(point.best_m);
    }
    if (kept.x.empty()) continue;
    chart.series.push_back(std::move(kept));
    chart.series.push_back(std::move(best));
  }
  return chart;
}

Chart wrong_gate_chart(const Evaluation& evaluation, const Evaluation::Set& set) {
  Chart chart;
  chart.title = "Wrong gates among the frames let through (validity as the bundle says), " + set.name;
  chart.x = {.label = "frames with a gate let through", .unit = "%"};
  chart.y = {.label = "of these, centre more than 0.5 m off", .unit = "%"};
  chart.x.low = 40.0;
  chart.x.high = 100.0;
  chart.y.low = 0.0;
  chart.key = Key::kTopLeft;
  for (const Mode mode : kModes) {
    const auto frames = candidates(set.frames, 0, mode);
    std::vector<double> predicted;
    for (const Candidate& frame : frames)
      if (frame.has_gate && std::isfinite(frame.predicted_m)) predicted.push_back(frame.predicted_m);
    Series wrong{.name = name_of(mode), .color = color_of(mode)};
    Series nowhere{.name = std::string(name_of(mode)) + ", on no gate at all", .dashed = true, .color = color_of(mode)};
    for (int i = 40; i <= 100 && !predicted.empty(); ++i) {
      const LetThrough r =
          let_through(frames, {evaluation.bundles[0].validity_threshold, quantile(predicted, 0.01 * i)});
      if (r.kept_n == 0) continue;
      for (Series* series : {&wrong, &nowhere}) series->x.push_back(r.kept_percent());
      wrong.y.push_back(r.wrong_percent());
      nowhere.y.push_back(r.nowhere_percent());
    }
    if (wrong.x.empty()) continue;
    chart.series.push_back(std::move(wrong));
    chart.series.push_back(std::move(nowhere));
  }
  return chart;
}

Chart distance_chart(const Evaluation& evaluation, const Evaluation::Set& set) {
  Chart chart;
  chart.title = "Error of the centre by distance, " + set.name;
  chart.x = {.label = "distance", .unit = "m"};
  chart.y = {.label = "error of the centre, fitted to the field alone", .unit = "m", .logarithmic = true};
  chart.key = Key::kTopLeft;
  for (const Mode mode : kModes) {
    Series median{
        .name = std::string(name_of(mode)) + ", median", .style = Style::kLinePoints, .color = color_of(mode)};
    Series p90{.name = std::string(name_of(mode)) + ", 90th percentile", .dashed = true, .color = color_of(mode)};
    for (double from_m = 0.5; from_m < 10.0; from_m += kBin_m) {
      const Selected selected = select(set.frames, 0, mode, [&](const GateFacts& g) {
        return g.distance_m >= from_m && g.distance_m < from_m + kBin_m;
      });
      if (selected.truth.size() < kFewInBin) continue;
      const Summary s = summarize(selected.measured, evaluation.bundles[0].validity_threshold);
      for (Series* series : {&median, &p90}) series->x.push_back(from_m + 0.5 * kBin_m);
      median.y.push_back(s.center_median_m);
      p90.y.push_back(s.center_p90_m);
    }
    if (median.x.empty()) continue;
    chart.series.push_back(std::move(median));
    chart.series.push_back(std::move(p90));
  }
  return chart;
}

Chart approach_chart(const Evaluation& evaluation) {
  Chart chart;
  chart.title = "Error of the centre along approaches";
  chart.x = {.label = "distance", .unit = "m"};
  chart.y = {.label = "error of the centre", .unit = "m"};
  chart.y.low = 0.0;
  chart.key = Key::kTopLeft;
  std::vector<Series> all{{.name = "single frame, median", .style = Style::kLinePoints, .color = 0},
                          {.name = "single frame, 90th percentile", .dashed = true, .color = 0},
                          {.name = "gate memory, median", .style = Style::kLinePoints, .color = 1},
                          {.name = "gate memory, 90th percentile", .dashed = true, .color = 1}};
  for (double from_m = 1.0; from_m < 8.0; from_m += kBin_m) {
    const ApproachRow row = approach_row(evaluation.approaches[0], from_m, from_m + kBin_m);
    if (static_cast<std::size_t>(row.count) < kFewInBin) continue;
    for (Series& series : all) series.x.push_back(from_m + 0.5 * kBin_m);
    all[0].y.push_back(row.frame_median_m);
    all[1].y.push_back(row.frame_p90_m);
    all[2].y.push_back(row.memory_median_m);
    all[3].y.push_back(row.memory_p90_m);
  }
  if (!all[0].x.empty()) chart.series = std::move(all);
  return chart;
}

Chart comparison_chart(const Evaluation& evaluation, const Evaluation::Set& set, Mode mode, bool center) {
  Chart chart;
  chart.title = std::string(center ? "Median error of the centre, " : "Mean error within 1 m of the gate, ") +
                set.name + ", " + name_of(mode);
  chart.y = {.label = center ? "centre" : "box", .unit = "m"};
  chart.y.low = 0.0;
  chart.key = Key::kOutside;
  const std::vector<std::string> places = {"1 to 2 m", "2 to 4 m", "4 to 7 m", "core", "all"};
  chart.x.label = "gate at";
  chart.x.low = -0.6;
  chart.x.high = static_cast<double>(places.size()) - 0.4;
  for (std::size_t i = 0; i < places.size(); ++i) chart.x.ticks.emplace_back(static_cast<double>(i), places[i]);
  for (std::size_t bundle = 0; bundle < evaluation.bundles.size(); ++bundle) {
    Series series{.name = evaluation.bundles[bundle].name, .style = Style::kBars};
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto group =
          std::find_if(groups().begin(), groups().end(), [&](const Group& g) { return g.name == places[i]; });
      const Summary s = summarize(select(set.frames, bundle, mode, group->holds).measured, 0.5);
      series.x.push_back(static_cast<double>(i));
      series.y.push_back(center ? s.center_median_m : s.box_m);
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

}  // namespace

std::vector<std::pair<std::string, Chart>> charts_of(const Evaluation& evaluation) {
  std::vector<std::pair<std::string, Chart>> out;
  const auto add = [&](const std::string& name, Chart chart) {
    if (!chart.series.empty()) out.emplace_back(file_name(name), std::move(chart));
  };
  for (const Evaluation::Set& set : evaluation.sets) {
    add("distance-" + set.name, distance_chart(evaluation, set));
    add("roc-" + set.name, roc_chart(set));
    add("calibration-" + set.name, calibration_chart(set));
    add("risk-" + set.name, risk_chart(set));
    add("wrong-gate-" + set.name, wrong_gate_chart(evaluation, set));
    if (evaluation.bundles.size() < 2) continue;
    for (const Mode mode : kModes) {
      const std::string which = std::string(mode == Mode::kPrior ? "prior-" : "first-look-") + set.name;
      add("compare-centre-" + which, comparison_chart(evaluation, set, mode, true));
      add("compare-box-" + which, comparison_chart(evaluation, set, mode, false));
    }
  }
  if (!evaluation.approaches.empty()) add("approach", approach_chart(evaluation));
  return out;
}

}  // namespace gatefield::training
