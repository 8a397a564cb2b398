#include "server/training/evaluation/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/training/evaluation/judge.h"
#include "server/training/evaluation/selection.h"
#include "server/training/evaluation/statistics.h"

namespace gatefield::training {
namespace {

using plot::Cell;
using plot::Table;

constexpr int kBins = 10;
constexpr int kWindow = 10;

Cell count(int n) { return {static_cast<double>(n), 0}; }

std::string mode_title(const Evaluation& evaluation, Mode mode) {
  return mode == Mode::kPrior ? fmt::format("with a prior (truth + {:g} m per axis)", evaluation.options.prior_sigma_m)
                              : std::string("first look, without a prior");
}

/// "0.033 (0.030) missed"
Cell judged(const Target& target) {
  if (target.count == 0) return "-";
  const int d = target.digits;
  Cell cell(fmt::format("{:.{}f} ({:.{}f}) {}", target.value, d, target.bar, d, target.met() ? "met" : "missed"));
  return cell;
}

Table distance_target_table(const Evaluation& evaluation) {
  const std::vector<Target> targets = distance_targets(evaluation);
  Table table;
  table.title = "Targets: errors by distance, figure (bar)";
  table.columns = {"set, mode, gates, distance", "n"};
  int met = 0, images = 0;
  for (const Target& target : targets) {
    if (std::find(table.columns.begin(), table.columns.end(), target.what) == table.columns.end())
      table.columns.push_back(target.what);
    if (table.rows.empty() || table.rows.back()[0].text != target.where)
      table.rows.push_back({target.where, count(target.count)});
    table.rows.back().push_back(judged(target));
    met += target.met() ? 1 : 0;
  }
  for (const Evaluation::Set& set : evaluation.sets) {
    if (set.kind == DatasetKind::kSimulation)
      images = std::max(images, static_cast<int>(select(set.frames, 0, Mode::kPrior).truth.size()));
  }
  table.note = fmt::format("{} of {} met.", met, targets.size());
  if (images < kFewestImages)
    table.note += fmt::format(" Only {} images with a gate; the bars ask for {} at least.", images, kFewestImages);
  return table;
}

Table other_target_table(const Evaluation& evaluation) {
  const std::vector<Target> targets = other_targets(evaluation);
  Table table;
  table.title = "Targets: the rest";
  table.columns = {"figure", "measured on", "n", "value", "bar", ""};
  int met = 0;
  for (const Target& target : targets) {
    table.rows.push_back({target.what,
                          target.where,
                          count(target.count),
                          {target.value, target.digits},
                          fmt::format("{} {:.{}f}", target.at_most ? "<=" : ">=", target.bar, target.digits),
                          target.met() ? "met" : "missed"});
    met += target.met() ? 1 : 0;
  }
  table.note = fmt::format("{} of {} met.", met, targets.size());
  return table;
}

Table error_table(const Evaluation& evaluation, const Evaluation::Set& set, Mode mode) {
  Table table;
  table.title = "Errors, " + set.name + ", " + mode_title(evaluation, mode);
  table.columns = {"by",
                   "gate",
                   "n",
                   "all, m",
                   "(const.)",
                   "near, m",
                   "(const.)",
                   "box, m",
                   "(const.)",
                   "box median",
                   "sign, %",
                   "(const.)",
                   "centre, m",
                   "p90",
                   "(const.)",
                   "normal, deg",
                   "p90",
                   "(const.)",
                   "encoder's centre, m",
                   "fitted, %",
                   "valid, %"};
  if (mode == Mode::kPrior) table.columns.emplace_back("prior alone, m");
  for (const Group& group : groups()) {
    const Selected selected = select(set.frames, 0, mode, group.holds);
    if (selected.truth.empty()) continue;
    const Summary s = summarize(selected.measured, evaluation.bundles[0].validity_threshold);
    const Constant c = constant_baseline(selected.truth);
    table.rows.push_back({group.by,
                          group.name,
                          count(s.count),
                          {s.all_m, 3},
                          {c.all_m, 3},
                          {s.near_m, 3},
                          {c.near_m, 3},
                          {s.box_m, 3},
                          {c.box_m, 3},
                          {s.box_median_m, 3},
                          {s.sign_percent, 1},
                          {c.sign_percent, 1},
                          {s.center_median_m, 3},
                          {s.center_p90_m, 3},
                          {c.center_median_m, 2},
                          {s.normal_median_deg, 2},
                          {s.normal_p90_deg, 1},
                          {c.normal_median_deg, 0},
                          {s.encoder_center_median_m >= kFailedCenter_m ? std::nan("") : s.encoder_center_median_m, 3},
                          {s.fitted_percent, 1},
                          {s.valid_percent, 1}});
    if (mode == Mode::kPrior) table.rows.back().push_back({c.prior_median_m, 3});
  }
  table.note =
      "Means over the images; centre and normal: medians and 90th percentiles of an hourglass fitted to the field "
      "alone (10 m and 90 deg where none fits). (const.): the best constant field, centre and axis on the same images. "
      "core: 1 to 4 m, below 60 deg, at least half visible.";
  return table;
}

Table validity_table(const Evaluation& evaluation, const Evaluation::Set& set) {
  Table table;
  table.title = "Validity, " + set.name;
  table.columns = {"empty is",
                   "valid n",
                   "empty n",
                   "area under ROC",
                   "valid kept, %",
                   "empty recognised, %",
                   "at 95 % kept: recognised, %",
                   "threshold"};
  const double threshold = evaluation.bundles[0].validity_threshold;
  const auto row = [&](const char* name, Empty empty) {
    int with = 0, without = 0;
    const auto curve = validity_curve(set.frames, 0, empty, &with, &without);
    if (curve.empty()) return;
    const RocPoint today = at_threshold(curve, threshold);
    const RocPoint kept = keeping(curve, kKeptPart);
    table.rows.push_back({name,
                          count(with),
                          count(without),
                          {area_under(curve), 4},
                          {100.0 * today.kept, 1},
                          {100.0 * (1.0 - today.false_alarms), 2},
                          {100.0 * (1.0 - kept.false_alarms), 2},
                          {kept.threshold, 3}});
  };
  row("first look: nothing of any gate in view", Empty::kNothing);
  row("first look: less than 12 % of any gate", Empty::kLittle);
  row("first look: no valid gate (less than 25 %)", Empty::kNoValid);
  row("prior: a place 2 m and more from every gate", Empty::kPlaces);
  table.note = fmt::format("Kept and recognised at the bundle's threshold, {:.2f}, unless said otherwise.", threshold);
  return table;
}

Table calibration_table(const Evaluation& evaluation, const Evaluation::Set& set, Mode mode) {
  const Predictions p = predictions(set.frames, 0, mode);
  Table table;
  table.title = "Predicted error, " + set.name + ", " + mode_title(evaluation, mode);
  table.columns = {"tenth", "n", "predicted, m", "actual box error, m", "p10", "p90"};
  const auto bins = calibrate(p.predicted_m, p.actual_m, kBins);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    table.rows.push_back({count(static_cast<int>(i) + 1),
                          count(bins[i].count),
                          {bins[i].predicted_m, 3},
                          {bins[i].actual_m, 3},
                          {bins[i].actual_p10_m, 3},
                          {bins[i].actual_p90_m, 3}});
  }
  const auto risk = risk_coverage(p.predicted_m, p.actual_m, 5);
  table.note = fmt::format("Spearman {:.2f}; mean |predicted - actual| over the tenths {:.3f} m.",
                           spearman(p.predicted_m, p.actual_m), calibration_error(bins));
  if (risk.size() == 5) {
    table.note += fmt::format(" Without the worst fifth {:.3f} instead of {:.3f} m ({:.3f} if the errors were known).",
                              risk[3].mean_m, risk[4].mean_m, risk[3].best_m);
  }
  return table;
}

Table wrong_gate_table(const Evaluation& evaluation, const Evaluation::Set& set, Mode mode) {
  const std::vector<Candidate> frames = candidates(set.frames, 0, mode);
  Table table;
  table.title = fmt::format("Wrong gates (centre more than {:g} m off), ", kWrongGate_m) + set.name + ", " +
                mode_title(evaluation, mode);
  table.columns = {"let through", "n",       "let through, %", "wrong, n",           "on another gate, n",
                   "wrong, %",    "empty n", "phantoms, n",    "wrong or phantom, %"};
  const auto row = [&](const std::string& name, const LetThrough& r, bool phantoms) {
    const bool shown = phantoms && r.empty_n > 0;
    table.rows.push_back({name,
                          count(r.gates_n),
                          {r.kept_percent(), 1},
                          count(r.wrong_n),
                          count(r.other_n),
                          {r.wrong_percent(), 2},
                          shown ? count(r.empty_n) : Cell("-"),
                          shown ? count(r.phantom_n) : Cell("-"),
                          shown ? Cell(r.wrong_or_phantom_percent(), 2) : Cell("-")});
  };
  row("everything", let_through(frames, {0.0}), true);
  const double threshold = evaluation.bundles[0].validity_threshold;
  row(fmt::format("validity >= {:.2f} (the bundle's)", threshold), let_through(frames, {threshold}), true);
  LetThrough memory;
  for (const Measured* m : select(set.frames, 0, mode).measured) {
    ++memory.gates_n;
    memory.kept_n += m->taken ? 1 : 0;
    const bool wrong = m->taken && m->center_m > kWrongGate_m;
    memory.wrong_n += wrong ? 1 : 0;
    memory.other_n += wrong && m->other_gate ? 1 : 0;
  }
  row("gate memory as it is (validity, fit, place)", memory, false);
  const Thresholds best = best_thresholds(frames, kLetThroughPercent / 100.0);
  row(fmt::format("best pair: validity >= {:.3f}, predicted <= {:.3f} m", best.validity_min, best.predicted_max_m),
      let_through(frames, best), true);
  row("best pair, cross-checked", cross_checked(frames, kLetThroughPercent / 100.0), true);
  table.note = fmt::format(
      "Best pair: the fewest wrong with at least {:g} % let through; cross-checked: chosen on every other image, "
      "counted "
      "on the ones between. Phantoms: let through although nothing of a gate is in view.",
      kLetThroughPercent);
  return table;
}

Table two_gates_table(const Evaluation& evaluation) {
  const TwoGatesOptions& options = evaluation.options.two_gates;
  Table table;
  table.title =
      fmt::format("Two gates in view whose distances differ by less than {:g} m; prior: one of them + {:g} m per axis",
                  options.difference_m, options.prior_sigma_m);
  table.columns = {"bundle",    "n",   "the named one, %",          "the other, %", "neither, %",
                   "centre, m", "p90", "first look: one of them, %"};
  for (std::size_t i = 0; i < evaluation.two_gates.size(); ++i) {
    const TwoGatesResult& r = evaluation.two_gates[i];
    const double n = std::max(1, r.count);
    table.rows.push_back({evaluation.bundles[i].name,
                          count(r.count),
                          {r.named_percent(), 2},
                          {100.0 * r.other / n, 2},
                          {100.0 * r.neither / n, 2},
                          {r.center_median_m, 3},
                          {r.center_p90_m, 3},
                          {r.first_one_percent(), 1}});
  }
  return table;
}

Table approach_table(const Evaluation& evaluation) {
  const ApproachOptions& options = evaluation.options.approach;
  Table table;
  table.title =
      fmt::format("Approaches from {:g} to {:g} m at 5 to 9 m/s, 30 to 60 frames a second, waypoint {:g} m off: centre",
                  options.from_m, options.to_m, options.nominal_m);
  table.columns = {"bundle", "gate at", "frames", "single frame, m", "p90", "memory, m", "p90", "waypoint alone, m"};
  for (std::size_t i = 0; i < evaluation.approaches.size(); ++i) {
    for (const auto& [from_m, to_m] : {std::pair{1.0, 2.0}, {2.0, 4.0}, {1.0, 4.0}, {4.0, 7.0}, {7.0, 8.0}}) {
      const ApproachRow row = approach_row(evaluation.approaches[i], from_m, to_m);
      if (row.count == 0) continue;
      table.rows.push_back({evaluation.bundles[i].name,
                            fmt::format("{:g} to {:g} m", from_m, to_m),
                            count(row.count),
                            {row.frame_median_m, 3},
                            {row.frame_p90_m, 3},
                            {row.memory_median_m, 3},
                            {row.memory_p90_m, 3},
                            {options.nominal_m, 3}});
    }
  }
  table.note = fmt::format(
      "{} flights; frames with a valid gate. Single frame: the field of one image, looked at where the memory said. "
      "Memory: the gate memory's centre after that frame. Both as the server runs them.",
      options.count);
  return table;
}

Table bias_table(const Evaluation& evaluation) {
  Table table;
  table.title = fmt::format("Bias and noise over windows of {} frames of an approach", kWindow);
  table.columns = {
      "bundle",   "windows",          "left out",         "single, m", "mean of window, m", "spread in window, m",
      "noise, %", "of the window, %", "of the flight, %", "of all, %", "all: x, m",         "y, m",
      "z, m"};
  for (std::size_t i = 0; i < evaluation.approaches.size(); ++i) {
    const BiasAndNoise b = bias_and_noise(evaluation.approaches[i], kWindow);
    const double total = b.total_m2() > 0.0 ? b.total_m2() : std::nan("");
    table.rows.push_back({evaluation.bundles[i].name,
                          count(b.windows),
                          count(b.left_out),
                          {b.single_median_m, 3},
                          {b.bias_median_m, 3},
                          {b.spread_median_m, 3},
                          {100.0 * b.noise_m2 / total, 1},
                          {100.0 * b.window_m2 / total, 1},
                          {100.0 * b.flight_m2 / total, 1},
                          {100.0 * b.global_m2 / total, 1},
                          {b.mean_G.x(), 4},
                          {b.mean_G.y(), 4},
                          {b.mean_G.z(), 4}});
  }
  table.note = fmt::format(
      "Medians of the length of a single frame's error, of a window's mean error (bias) and of the root mean square "
      "about it (noise). The per cents share out the mean square: noise from frame to frame, bias of a window, of a "
      "whole flight, common to all; the latter in the gate's frame (x through the opening). Left out: windows with a "
      "centre missing or more than {:g} m off.",
      kWrongGate_m);
  return table;
}

Table comparison_table(const Evaluation& evaluation, const Evaluation::Set& set, Mode mode) {
  Table table;
  table.title = "Bundles side by side, " + set.name + ", " + mode_title(evaluation, mode);
  table.columns = {"bundle",
                   "n",
                   "all, m",
                   "near, m",
                   "box, m",
                   "sign, %",
                   "centre, m",
                   "p90",
                   "normal, deg",
                   "centre 1 to 2 m",
                   "centre 2 to 4 m",
                   "centre 4 to 7 m",
                   "box 1 to 2 m",
                   "box 2 to 4 m",
                   "box 4 to 7 m",
                   "Spearman",
                   "empty recognised, %"};
  for (std::size_t i = 0; i < evaluation.bundles.size(); ++i) {
    const double threshold = evaluation.bundles[i].validity_threshold;
    const Summary s = summarize(select(set.frames, i, mode).measured, threshold);
    std::vector<Cell> row{
        evaluation.bundles[i].name, count(s.count),         {s.all_m, 3},        {s.near_m, 3},           {s.box_m, 3},
        {s.sign_percent, 1},        {s.center_median_m, 3}, {s.center_p90_m, 3}, {s.normal_median_deg, 2}};
    std::vector<Cell> box;
    for (const auto& [from_m, to_m] : {std::pair{1.0, 2.0}, {2.0, 4.0}, {4.0, 7.0}}) {
      const double from = from_m, to = to_m;
      const Summary part = summarize(
          select(set.frames, i, mode, [&](const GateFacts& g) { return g.distance_m >= from && g.distance_m < to; })
              .measured,
          threshold);
      row.push_back({part.center_median_m, 3});
      box.push_back({part.box_m, 3});
    }
    row.insert(row.end(), box.begin(), box.end());
    const Predictions p = predictions(set.frames, i, mode);
    row.push_back({spearman(p.predicted_m, p.actual_m), 2});
    const auto curve = validity_curve(set.frames, i, mode == Mode::kPrior ? Empty::kPlaces : Empty::kNothing);
    row.push_back({curve.empty() ? std::nan("") : 100.0 * (1.0 - keeping(curve, kKeptPart).false_alarms), 1});
    table.rows.push_back(std::move(row));
  }
  const Constant c = constant_baseline(select(set.frames, 0, mode).truth);
  table.rows.push_back({"best constant",
                        count(static_cast<int>(select(set.frames, 0, mode).truth.size())),
                        {c.all_m, 3},
                        {c.near_m, 3},
                        {c.box_m, 3},
                        {c.sign_percent, 1},
                        {c.center_median_m, 2},
                        "-",
                        {c.normal_median_deg, 0},
                        "-",
                        "-",
                        "-",
                        "-",
                        "-",
                        "-",
                        "-",
                        "-"});
  table.note = "Recognised: empty ones at 95 % of the valid ones kept.";
  return table;
}

}  // namespace

std::vector<Table> tables_of(const Evaluation& evaluation) {
  std::vector<Table> out;
  const bool simulated = std::any_of(evaluation.sets.begin(), evaluation.sets.end(),
                                     [](const auto& set) { return set.kind == DatasetKind::kSimulation; });
  if (simulated) out.push_back(distance_target_table(evaluation));
  out.push_back(other_target_table(evaluation));
  for (const Evaluation::Set& set : evaluation.sets) {
    for (const Mode mode : kModes) out.push_back(error_table(evaluation, set, mode));
    out.push_back(validity_table(evaluation, set));
    for (const Mode mode : kModes) out.push_back(calibration_table(evaluation, set, mode));
    for (const Mode mode : kModes) out.push_back(wrong_gate_table(evaluation, set, mode));
  }
  if (!evaluation.two_gates.empty()) out.push_back(two_gates_table(evaluation));
  if (!evaluation.approaches.empty()) {
    out.push_back(approach_table(evaluation));
    out.push_back(bias_table(evaluation));
  }
  if (evaluation.bundles.size() > 1)
    for (const Evaluation::Set& set : evaluation.sets)
      for (const Mode mode : kModes) out.push_back(comparison_table(evaluation, set, mode));
  return out;
}

}  // namespace gatefield::training
