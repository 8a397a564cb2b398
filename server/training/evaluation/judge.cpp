#include "server/training/evaluation/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "server/training/evaluation/selection.h"

namespace gatefield::training {
namespace {

std::string metres(double from_m, double to_m) { return fmt::format("{:g} to {:g} m", from_m, to_m); }

/// "Stage 1", "stage-1", "race_stage1" all have stage1 in them.
std::optional<std::size_t> bundle_with(const Evaluation& evaluation, const std::string& word) {
  for (std::size_t i = 0; i < evaluation.bundles.size(); ++i) {
    std::string plain;
    for (const char c : evaluation.bundles[i].name)
      if (std::isalnum(static_cast<unsigned char>(c)) != 0)
        plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (plain.find(word) != std::string::npos) return i;
  }
  return std::nullopt;
}

Summary summary_of(const Evaluation& evaluation, const Evaluation::Set& set, std::size_t bundle, Mode mode,
                   const std::function<bool(const GateFacts&)>& holds) {
  return summarize(select(set.frames, bundle, mode, holds).measured, evaluation.bundles[bundle].validity_threshold);
}

struct Kind {
  const char* name;
  double factor;
  std::function<bool(const GateFacts&)> holds;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {"all places", 1.0, [](const GateFacts&) { return true; }},
      {"60 to 80 deg", kHardFactor, [](const GateFacts& g) { return g.axis_deg >= 60.0 && g.axis_deg < 80.0; }},
      {"half visible", kHardFactor,
       [](const GateFacts& g) {
         return g.visible_fraction >= kHalfVisibleFrom && g.visible_fraction < kHalfVisibleTo;
       }},
  };
  return all;
}

void second_sensor(const Evaluation& evaluation, const Evaluation::Set& set, std::vector<Target>* out) {
  const auto everything = [](const GateFacts&) { return true; };
  for (const Mode mode : kModes) {
    const std::string where = set.name + ", " + name_of(mode);
    const Summary both = summary_of(evaluation, set, 0, mode, everything);
    const auto compare = [&](const char* word, const char* name, double bar) {
      const auto other = bundle_with(evaluation, word);
      if (!other || *other == 0) return;
      const Summary alone = summary_of(evaluation, set, *other, mode, everything);
      const auto add = [&](const char* what, double value, double against) {
        out->push_back(
            {std::string(what) + " / that of " + name + " alone", where, both.count, value / against, bar, true, 2});
      };
      add("field error", both.all_m, alone.all_m);
      add("box error", both.box_m, alone.box_m);
      add("centre, median", both.center_median_m, alone.center_median_m);
    };
    compare("stage1", "stage 1", kBetterThanStage1);
    compare("stage2", "stage 2", kBetterThanStage2);
    for (const Evaluation::Set& simulated : evaluation.sets) {
      if (simulated.kind != DatasetKind::kSimulation) continue;
      for (const DistanceBar& bar : kDistanceBars) {
        const auto near = [&](const GateFacts& g) { return g.distance_m >= bar.from_m && g.distance_m < bar.to_m; };
        const Summary here = summary_of(evaluation, set, 0, mode, near);
        const Summary there = summary_of(evaluation, simulated, 0, mode, near);
        const auto add = [&](const char* what, double value, double against) {
          out->push_back({std::string(what) + " / that in " + simulated.name + ", " + metres(bar.from_m, bar.to_m),
                          where, std::min(here.count, there.count), value / against, kOtherSensorFactor, true, 2});
        };
        add("centre, median", here.center_median_m, there.center_median_m);
        add("normal, median", here.normal_median_deg, there.normal_median_deg);
        add("box error", here.box_m, there.box_m);
      }
    }
  }
}

}  // namespace

std::vector<Target> distance_targets(const Evaluation& evaluation) {
  std::vector<Target> out;
  for (const Evaluation::Set& set : evaluation.sets) {
    if (set.kind != DatasetKind::kSimulation) continue;
    for (const Mode mode : kModes) {
      for (const Kind& kind : kinds()) {
        for (const DistanceBar& bar : kDistanceBars) {
          const Summary s = summary_of(evaluation, set, 0, mode, [&](const GateFacts& g) {
            return g.distance_m >= bar.from_m && g.distance_m < bar.to_m && kind.holds(g);
          });
          const std::string where =
              set.name + ", " + name_of(mode) + ", " + kind.name + ", " + metres(bar.from_m, bar.to_m);
          const auto add = [&](const char* what, double value, double limit, bool at_most, int digits) {
            out.push_back({what, where, s.count, value, limit, at_most, digits});
          };
          // A sign accuracy of 95 % may be 1.5 times as often wrong: 92.5 %.
          const double sign = 100.0 - kind.factor * (100.0 - bar.sign_percent);
          add("centre median, m", s.center_median_m, kind.factor * bar.center_median_m, true, 3);
          add("centre p90, m", s.center_p90_m, kind.factor * bar.center_p90_m, true, 3);
          add("normal median, deg", s.normal_median_deg, kind.factor * bar.normal_median_deg, true, 2);
          add("box median, m", s.box_median_m, kind.factor * bar.box_m, true, 3);
          add("box mean, m", s.box_m, kind.factor * bar.box_m, true, 3);
          add("sign median, %", s.sign_median_percent, sign, false, 1);
          add("sign mean, %", s.sign_percent, sign, false, 1);
        }
      }
    }
  }
  return out;
}

std::vector<Target> other_targets(const Evaluation& evaluation) {
  std::vector<Target> out;
  if (!evaluation.approaches.empty()) {
    for (const ApproachBar& bar : kApproachBars) {
      const ApproachRow row = approach_row(evaluation.approaches[0], bar.from_m, bar.to_m);
      out.push_back({"centre median of single frames with the memory's prior, " + metres(bar.from_m, bar.to_m) + ", m",
                     "approaches", row.count, row.frame_median_m, bar.center_median_m, true, 3});
      out.push_back({"centre median of the memory, " + metres(bar.from_m, bar.to_m) + ", m", "approaches", row.count,
                     row.memory_median_m, bar.center_median_m, true, 3});
    }
  }
  for (const Evaluation::Set& set : evaluation.sets) {
    if (set.kind != DatasetKind::kSimulation) continue;
    for (const Mode mode : kModes) {
      const LetThrough best = cross_checked(candidates(set.frames, 0, mode), kLetThroughPercent / 100.0);
      const std::string what =
          fmt::format("wrong gates among frames let through ({:.1f} % of them), %", best.kept_percent());
      out.push_back(
          {what, set.name + ", " + name_of(mode), best.kept_n, best.wrong_percent(), kWrongGatePercent, true, 2});
      out.push_back({"the same, those on no gate at all, %", set.name + ", " + name_of(mode), best.kept_n,
                     best.nowhere_percent(), kWrongGatePercent, true, 2});
    }
    int with = 0, without = 0;
    for (const Empty empty : {Empty::kNothing, Empty::kNoValid}) {
      const auto curve = validity_curve(set.frames, 0, empty, &with, &without);
      if (curve.empty()) continue;
      out.push_back({std::string(empty == Empty::kNothing ? "no gate in view" : "no valid gate in view") +
                         " recognised at 95 % of the valid ones kept, %",
                     set.name + ", " + name_of(Mode::kFirstLook), without,
                     100.0 * (1.0 - keeping(curve, kKeptPart).false_alarms), kEmptyPercent, false, 1});
    }
  }
  if (!evaluation.two_gates.empty()) {
    const TwoGatesResult& pairs = evaluation.two_gates[0];
    out.push_back({"two gates at nearly the same distance: the named one, %", "pairs", pairs.count,
                   pairs.named_percent(), kNamedGatePercent, false, 2});
  }
  for (const Evaluation::Set& set : evaluation.sets)
    if (set.kind != DatasetKind::kSimulation) second_sensor(evaluation, set, &out);
  return out;
}

}  // namespace gatefield::training
