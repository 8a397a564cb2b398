#include "client/race/cause.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/simulator/simulation.h"
#include "common/base/statistics.h"

namespace gatefield::race {
namespace {

using simulator::Outcome;

/// The waypoint that the race was lost at: the one whose gate was touched, else the one that was next.
int waypoint_of(const simulator::Report& report) {
  if (report.outcome == Outcome::kTouchedGate && report.culprit >= 0) return report.culprit;
  return report.samples.empty() ? -1 : report.samples.back().expected_waypoint;
}

/// When that gate was passed in the last lap: a frame touched on the way out is judged by the belief before it.
double judged_until_s(const simulator::Report& report, int waypoint) {
  if (!report.passes.empty() && report.passes.back().waypoint == waypoint &&
      (report.samples.empty() || report.samples.back().expected_waypoint != waypoint))
    return seconds(report.passes.back().time);
  return report.race_time_s;
}

}  // namespace

const char* name(Cause cause) noexcept {
  switch (cause) {
    case Cause::kNone:
      return "won";
    case Cause::kPerceptionWrong:
      return "perception_wrong";
    case Cause::kSeenTooLate:
      return "seen_too_late";
    case Cause::kReferee:
      return "referee";
    case Cause::kControl:
      return "control";
    case Cause::kNotRecorded:
      return "not_recorded";
  }
  return "unknown";
}

const char* words(Cause cause) noexcept {
  switch (cause) {
    case Cause::kNone:
      return "won";
    case Cause::kPerceptionWrong:
      return "perception wrong";
    case Cause::kSeenTooLate:
      return "seen too late";
    case Cause::kReferee:
      return "referee";
    case Cause::kControl:
      return "control";
    case Cause::kNotRecorded:
      return "not recorded";
  }
  return "unknown";
}

Diagnosis diagnose(const simulator::Report& report, const std::vector<trace::Step>& trace,
                   const std::vector<scene::Gate>& gates) {
  Diagnosis found;
  if (report.outcome == Outcome::kFinished) return found;
  found.waypoint = waypoint_of(report);
  if (trace.empty() || found.waypoint < 0 || found.waypoint >= static_cast<int>(gates.size())) {
    found.cause = Cause::kNotRecorded;
    return found;
  }
  const scene::Gate& gate = gates[static_cast<std::size_t>(found.waypoint)];
  const Eigen::Isometry3d& X_WG = gate.X_WG;
  const double wrong_center_m = kWrongCenter_m * gate.shape.inner_half_m / GateShape{}.inner_half_m;
  const auto gate_for_who_estimates = [&report, &X_WG](double t_s) -> Eigen::Isometry3d {
    const auto at = std::lower_bound(report.samples.begin(), report.samples.end(), t_s,
                                     [](const simulator::Sample& sample, double t) { return sample.t_s < t; });
    return at == report.samples.end() ? X_WG : at->X_EW * X_WG;
  };
  const double end_s = judged_until_s(report, found.waypoint);
  const double epoch_s = seconds(simulator::kLockstepEpoch);

  std::vector<double> centers_m, axes_rad;
  double first_seen_s = std::numeric_limits<double>::quiet_NaN();
  for (const trace::Step& step : trace) {
    const double t_s = seconds(step.stamp) - epoch_s;
    if (t_s > end_s) break;
    const bool ours = static_cast<int>(step.waypoint) == found.waypoint && !step.hold;
    if (ours && step.seen && !std::isfinite(first_seen_s)) first_seen_s = t_s;
    if (t_s < end_s - kJudged_s) continue;
    if (!ours || !step.seen) continue;
    const Eigen::Isometry3d X_EG = gate_for_who_estimates(t_s);
    centers_m.push_back((step.center_W - X_EG.translation()).norm());
    axes_rad.push_back(std::acos(std::clamp(std::abs(step.axis_W.dot(X_EG.linear().col(0))), 0.0, 1.0)));
  }
  found.center_error_m = quantile(centers_m, 0.5);
  found.axis_error_rad = quantile(axes_rad, 0.5);
  found.seen_before_s = end_s - first_seen_s;

  // Until the gate before is passed it is right to head for that one: only where the last step headed counts.
  const trace::Step* last = nullptr;
  for (const trace::Step& step : trace)
    if (seconds(step.stamp) - epoch_s <= end_s) last = &step;
  const bool other_gate = last != nullptr && (static_cast<int>(last->waypoint) != found.waypoint || last->hold);
  const bool seen = std::isfinite(first_seen_s);
  const bool wrong = other_gate || found.center_error_m > wrong_center_m || found.axis_error_rad > kWrongAxis_rad;
  if (seen && wrong) {
    found.cause = Cause::kPerceptionWrong;
  } else if (!seen || found.seen_before_s < kJudged_s) {
    found.cause = Cause::kSeenTooLate;
  } else if (report.outcome == Outcome::kTimeLimit || report.outcome == Outcome::kStalled ||
             report.outcome == Outcome::kOutOfBounds) {
    found.cause = Cause::kReferee;
  } else {
    found.cause = Cause::kControl;
  }
  return found;
}

}  // namespace gatefield::race
