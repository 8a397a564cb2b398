#include "server/training/evaluation/no_gate_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/random.h"
#include "common/base/statistics.h"
#include "common/base/whole_file.h"
#include "server/training/evaluation/roc.h"

namespace gatefield::training {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::array kKept{0.5, 0.8, 0.9, 0.95, 0.98, 0.99};
constexpr double kChosenKept = 0.95;

std::vector<GateLook> looks_of(const NoGateFrame& frame, bool prior) {
  return prior ? frame.told : std::vector<GateLook>{frame.free};
}

std::vector<GateLook> looks_of(const std::vector<NoGateFrame>& frames, bool prior) {
  std::vector<GateLook> all;
  for (const NoGateFrame& frame : frames) {
    const auto looks = looks_of(frame, prior);
    all.insert(all.end(), looks.begin(), looks.end());
  }
  return all;
}

/// A number of a look by which it can be told apart; the higher, the more of a gate.
struct Score {
  const char* name;
  const char* unit;
  double (*of)(const GateLook&);
  double sign;  ///< of the threshold as people know it
};
constexpr std::array<Score, 3> kScores{{
    {"validity", "", [](const GateLook& look) { return look.validity; }, 1.0},
    {"predicted error", " m", [](const GateLook& look) { return -look.predicted_m; }, -1.0},
    {"residual", " m", [](const GateLook& look) { return -look.residual_m; }, -1.0},
}};

std::vector<RocPoint> curve_of(const NoGateResult& result, bool prior, const Score& score) {
  std::vector<double> gates, empty;
  for (const GateLook& look : looks_of(result.gates, prior)) gates.push_back(score.of(look));
  for (const GateLook& look : looks_of(result.frames, prior)) empty.push_back(score.of(look));
  return roc_curve(gates, empty);
}

std::string cell(const Imagined& imagined) {
  return fmt::format("{} of {}: {:.1f} ({:.1f} to {:.1f})", imagined.imagined, imagined.looks, 100.0 * imagined.part(),
                     100.0 * imagined.interval.low, 100.0 * imagined.interval.high);
}

std::string percent(double part) { return std::isfinite(part) ? fmt::format("{:.1f}", 100.0 * part) : "-"; }

std::string row(const NoGateResult& result, const std::string& name, const Decision& free, const Decision& told) {
  const Imagined without = count(result, false, free), with = count(result, true, told);
  return fmt::format("| {} | {} | {} | {} | {} |\n", name, cell(without), percent(without.kept), cell(with),
                     percent(with.kept));
}

std::string joint_words(const JointThresholds& t) {
  return fmt::format("validity >= {:.4f}, predicted error <= {:.3f} m, residual <= {:.3f} m", t.validity_min,
                     t.predicted_max_m, t.residual_max_m);
}

std::string looks_csv(const NoGateResult& result) {
  std::string csv = "kind,name,returns,prior,validity,predicted_m,residual_m,taken\n";
  const auto add = [&](const char* kind, const std::vector<NoGateFrame>& frames) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const NoGateFrame& frame = frames[i];
      const std::string name = frame.name.empty() ? std::to_string(i) : frame.name;
      for (const bool prior : {false, true})
        for (const GateLook& look : looks_of(frame, prior))
          csv += fmt::format("{},{},{:.4f},{},{:.6f},{:.5f},{:.5f},{}\n", kind, name, frame.returns, prior ? 1 : 0,
                             look.validity, look.predicted_m, look.residual_m, look.taken ? 1 : 0);
    }
  };
  add("no gate", result.frames);
  add("gate", result.gates);
  return csv;
}

std::string roc_csv(const NoGateResult& result) {
  std::string csv = "prior,score,threshold,kept,imagined\n";
  for (const bool prior : {false, true})
    for (const Score& score : kScores)
      for (const RocPoint& point : curve_of(result, prior, score))
        csv += fmt::format("{},{},{:.6f},{:.5f},{:.5f}\n", prior ? 1 : 0, score.name, score.sign * point.threshold,
                           point.kept, point.false_alarms);
  return csv;
}

}  // namespace

Imagined count(const NoGateResult& result, bool prior, const Decision& decision) {
  Imagined out;
  std::vector<std::pair<double, double>> by_frame;  // imagined, looks
  for (const NoGateFrame& frame : result.frames) {
    const auto looks = looks_of(frame, prior);
    const auto n = static_cast<std::size_t>(std::ranges::count_if(looks, decision));
    out.imagined += n;
    out.looks += looks.size();
    by_frame.emplace_back(static_cast<double>(n), static_cast<double>(looks.size()));
  }
  const auto gates = looks_of(result.gates, prior);
  out.kept = gates.empty()
                 ? kNan
                 : static_cast<double>(std::ranges::count_if(gates, decision)) / static_cast<double>(gates.size());
  if (!prior || out.imagined == 0) {
    out.interval = wilson(out.imagined, prior ? result.frames.size() : out.looks);
    return out;
  }
  constexpr int kDraws = 2000;
  Random random(1, 1);
  std::vector<double> parts;
  for (int draw = 0; draw < kDraws; ++draw) {
    double imagined = 0.0, looks = 0.0;
    for (std::size_t i = 0; i < by_frame.size(); ++i) {
      const auto& [n, of] = by_frame[random.below(static_cast<std::uint32_t>(by_frame.size()))];
      imagined += n;
      looks += of;
    }
    parts.push_back(looks > 0.0 ? imagined / looks : 0.0);
  }
  out.interval = {quantile(parts, 0.025), quantile(parts, 0.975)};
  return out;
}

JointThresholds best_joint(const NoGateResult& result, bool prior, double kept) {
  const auto gates = looks_of(result.gates, prior), empty = looks_of(result.frames, prior);
  constexpr int kSteps = 16;
  const auto steps_of = [&](const Score& score) {
    std::vector<double> values, steps;
    for (const GateLook& look : gates) values.push_back(score.of(look));
    // From letting every gate through to losing twice of what may be lost.
    for (int i = 0; i <= kSteps; ++i) steps.push_back(quantile(values, std::min(1.0, 2.0 * (1.0 - kept) * i / kSteps)));
    return steps;
  };
  const auto validities = steps_of(kScores[0]), errors = steps_of(kScores[1]), residuals = steps_of(kScores[2]);
  JointThresholds best;
  std::size_t least = empty.size() + 1, most = 0;
  for (const double validity : validities)
    for (const double error : errors)
      for (const double residual : residuals) {
        const JointThresholds t{validity, -error, -residual};
        const auto pass = [&](const GateLook& look) { return t.pass(look); };
        const auto through = static_cast<std::size_t>(std::ranges::count_if(gates, pass));
        if (static_cast<double>(through) < kept * static_cast<double>(gates.size())) continue;
        const auto imagined = static_cast<std::size_t>(std::ranges::count_if(empty, pass));
        if (imagined < least || (imagined == least && through > most)) {
          best = t;
          least = imagined;
          most = through;
        }
      }
  return best;
}

std::string to_markdown(const NoGateResult& result) {
  std::string out = fmt::format(
      "# Gates imagined where none is\n\n{} frames of {}, model {}, {} waypoints told in each; {} simulated images "
      "with "
      "a gate say what a decision costs. Percent, 95 % intervals.\n\n",
      result.frames.size(), result.options.frames.folder.filename().string(), result.options.bundle.name,
      result.options.places, result.gates.size());
  out +=
      "| a gate is what has | without a prior: imagined | gates kept | with a prior: imagined | gates kept |\n"
      "| --- | --- | --- | --- | --- |\n";
  const double validity_min = result.validity_threshold;
  const Decision valid = [&](const GateLook& look) { return look.validity >= validity_min; };
  out += row(result, fmt::format("validity >= {:g} (the bundle's) alone", validity_min), valid, valid);
  if (!result.gates.empty()) {
    for (const Score& score : kScores) {
      const double free = keeping(curve_of(result, false, score), kChosenKept).threshold;
      const double told = keeping(curve_of(result, true, score), kChosenKept).threshold;
      out += row(
          result,
          fmt::format("{} alone, keeping {:g} % of the gates ({:.4g}{} without, {:.4g}{} with a prior)", score.name,
                      100.0 * kChosenKept, score.sign * free, score.unit, score.sign * told, score.unit),
          [&](const GateLook& look) { return score.of(look) >= free; },
          [&](const GateLook& look) { return score.of(look) >= told; });
    }
  }
  const Decision taken = [](const GateLook& look) { return look.taken; };
  out += row(result, "**what the product takes**", taken, taken);
  const auto any = std::ranges::count_if(result.frames, [](const NoGateFrame& frame) {
    return std::ranges::any_of(frame.told, [](const GateLook& look) { return look.taken; });
  });
  std::string chosen;
  if (!result.gates.empty()) {
    const JointThresholds free = best_joint(result, false, kChosenKept), told = best_joint(result, true, kChosenKept);
    out += row(
        result, fmt::format("all three together, keeping {:g} %, chosen on these frames", 100.0 * kChosenKept),
        [&](const GateLook& look) { return free.pass(look); }, [&](const GateLook& look) { return told.pass(look); });
    chosen = fmt::format(
        "All three together: without a prior {}; with one {}. They were chosen on these very frames "
        "and flatter themselves.\n",
        joint_words(free), joint_words(told));
  }
  out += fmt::format("\nFrames in which at least one of the {} waypoints becomes a gate: {} of {}. {}\n",
                     result.options.places, any, result.frames.size(), chosen);
  if (result.gates.empty()) return out;
  out +=
      "\n## What each number could do\n\nPercent of the looks at no gate that pass when that part of the gates is to "
      "be kept (threshold in brackets).\n\n| number | prior |";
  for (const double kept : kKept) out += fmt::format(" {:g} % |", 100.0 * kept);
  out += " area under the curve |\n| --- | --- |";
  for (std::size_t i = 0; i <= kKept.size(); ++i) out += " --- |";
  out += "\n";
  for (const bool prior : {false, true}) {
    for (const Score& score : kScores) {
      const auto curve = curve_of(result, prior, score);
      out += fmt::format("| {} | {} |", score.name, prior ? "with" : "without");
      for (const double kept : kKept) {
        const RocPoint point = keeping(curve, kept);
        out += fmt::format(" {:.1f} ({:.4g}) |", 100.0 * point.false_alarms, score.sign * point.threshold);
      }
      out += fmt::format(" {:.3f} |\n", area_under(curve));
    }
  }
  return out;
}

Status write_no_gate_report(const NoGateResult& result, const std::filesystem::path& folder) {
  for (const auto& [name, content] : {std::pair{"no-gate.md", to_markdown(result)},
                                      {"no-gate-looks.csv", looks_csv(result)},
                                      {"no-gate-roc.csv", roc_csv(result)}}) {
    if (const Status written = write_file(folder / name, content); !written) return written;
  }
  return {};
}

}  // namespace gatefield::training
