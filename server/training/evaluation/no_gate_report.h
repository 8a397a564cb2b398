#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/interval.h"
#include "common/base/result.h"
#include "server/training/evaluation/no_gate.h"

namespace gatefield::training {

/// A decision on one look: does it show a gate?
using Decision = std::function<bool(const GateLook&)>;

/// What a decision does with no prior or with one.
struct Imagined {
  std::size_t imagined = 0, looks = 0;  ///< in frames without a gate
  /// 95 %. Without a prior Wilson's; with one, places of one frame are not independent: whole frames are drawn again
  /// (bootstrap, 2000 times), and where nothing was imagined Wilson's of one look a frame.
  Interval interval;
  double kept = 0.0;  ///< part of the gates that is kept; NaN without any

  double part() const noexcept { return looks > 0 ? static_cast<double>(imagined) / static_cast<double>(looks) : 0.0; }
};
Imagined count(const NoGateResult& result, bool prior, const Decision& decision);

/// Thresholds on all three numbers together.
struct JointThresholds {
  double validity_min = 0.0, predicted_max_m = 0.0, residual_max_m = 0.0;
  bool pass(const GateLook& look) const noexcept {
    return look.validity >= validity_min && look.predicted_m <= predicted_max_m && look.residual_m <= residual_max_m;
  }
};
/// Those that imagine least among those that keep at least `kept` of the gates; searched over quantiles of the gates'
/// numbers. @pre there are gates
JointThresholds best_joint(const NoGateResult& result, bool prior, double kept);

/// Tables in Markdown.
std::string to_markdown(const NoGateResult& result);

/// Writes no-gate.md, no-gate-looks.csv (every look), no-gate-roc.csv (mode,score,threshold,kept,imagined: every
/// threshold that makes a difference) into a folder, which is made. Errors: what can't be written.
Status write_no_gate_report(const NoGateResult& result, const std::filesystem::path& folder);

}  // namespace gatefield::training
