#include "client/race/trial_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/race/files.h"
#include "common/base/statistics.h"
#include "common/base/text.h"

namespace gatefield::race {

std::string trial_name(const TrialResult& result) { return trial_name(result.cell, result.speed_m_s, result.seed); }

const char* name(Failure failure) noexcept {
  switch (failure) {
    case Failure::kNone:
      return "won";
    case Failure::kTargetGate:
      return "target_gate";
    case Failure::kOtherObject:
      return "other_object";
    case Failure::kLeftCourse:
      return "left_course";
    case Failure::kPassedBeside:
      return "passed_beside";
    case Failure::kWrongGate:
      return "wrong_gate";
    case Failure::kTimeout:
      return "timeout";
    case Failure::kLostControl:
      return "lost_control";
    case Failure::kLostServer:
      return "lost_server";
  }
  return "unknown";
}

const char* words(Failure failure) noexcept {
  switch (failure) {
    case Failure::kNone:
      return "won";
    case Failure::kTargetGate:
      return "target gate's frame";
    case Failure::kOtherObject:
      return "other object";
    case Failure::kLeftCourse:
      return "left the course";
    case Failure::kPassedBeside:
      return "passed beside";
    case Failure::kWrongGate:
      return "wrong gate";
    case Failure::kTimeout:
      return "timeout";
    case Failure::kLostControl:
      return "lost control";
    case Failure::kLostServer:
      return "lost server";
  }
  return "unknown";
}

Failure failure_of(const simulator::Report& report) noexcept {
  using simulator::Outcome;
  switch (report.outcome) {
    case Outcome::kFinished:
      return Failure::kNone;
    case Outcome::kTouchedGate: {
      const int last = report.passes.empty() ? -1 : report.passes.back().waypoint;
      const int next = report.samples.empty() ? 0 : report.samples.back().expected_waypoint;
      return report.culprit == next || report.culprit == last ? Failure::kTargetGate : Failure::kOtherObject;
    }
    case Outcome::kTouchedFloor:
    case Outcome::kTouchedClutter:
      return Failure::kOtherObject;
    case Outcome::kMissedGate:
      return Failure::kPassedBeside;
    case Outcome::kWrongGate:
    case Outcome::kWrongDirection:
      return Failure::kWrongGate;
    case Outcome::kOutOfBounds:
      return Failure::kLeftCourse;
    case Outcome::kTimeLimit:
    case Outcome::kStalled:
      return Failure::kTimeout;
    case Outcome::kLostControl:
      return Failure::kLostControl;
    case Outcome::kLinkLost:
    case Outcome::kFlightControllerLost:
    case Outcome::kInterrupted:
    case Outcome::kRunning:
      break;
  }
  return Failure::kLostServer;
}

TrialResult to_result(const Trial& trial, const simulator::Report& report, const std::vector<trace::Step>& trace) {
  TrialResult result;
  result.cell = trial.cell->name;
  result.speed_m_s = trial.speed_m_s;
  result.seed = trial.seed;
  result.planner_seed = trial.seed_of_planner();
  result.failure = failure_of(report);
  const config::Scenario& scenario = trial.cell->scenario;
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, trial.seed);
  const Diagnosis diagnosis = diagnose(report, trace, config::gates_by_waypoint(world, scenario.track.course));
  result.cause = diagnosis.cause;
  result.belief_error_m = diagnosis.center_error_m;
  result.belief_turn_deg = diagnosis.axis_error_rad * 180.0 / std::numbers::pi;
  result.seen_before_s = diagnosis.seen_before_s;
  result.outcome = simulator::name(report.outcome);
  result.gates_passed = static_cast<int>(report.passes.size());
  result.gates_total = report.gates_total;
  result.time_s = report.race_time_s;
  result.top_speed_m_s = report.top_speed_m_s;
  result.mean_speed_m_s = report.mean_speed_m_s;
  result.median_lap_s = quantile(report.lap_times_s, 0.5, Between::kLinear);
  result.slowest_lap_s = quantile(report.lap_times_s, 1.0);
  result.missed = report.missed_gates;
  result.retries = report.retries;
  result.hull = config::name(report.hull);
  result.clearance_m = report.clearance_m;
  for (const simulator::Pass& pass : report.passes)
    if (std::isfinite(pass.clearance_m)) result.clearances_m.push_back(pass.clearance_m);
  const int gates = report.gates_total / std::max(trial.cell->scenario.track.course.laps, 1);
  if (gates > 0) {
    // A race that is won ended at its last gate.
    const int place = std::min(result.gates_passed, report.gates_total - 1);
    result.gate = place % gates + 1;
    result.lap = place / gates + 1;
  }
  result.end_p_W = report.end_state.p_WB;
  result.frame = report.frames_sent;
  result.round_trip_p50_ms = 1e3 * report.link.round_trip_p50_s;
  result.round_trip_p99_ms = 1e3 * report.link.round_trip_p99_s;
  result.solve_p50_ms = 1e3 * report.link.solve_p50_s;
  result.flight = fingerprint(report);
  result.profile = trial.cell->profile;
  result.host = host_name();
  result.wall_s = report.wall_s;
  result.sentence = report.sentence;
  result.reproduce = reproduce_command(trial);
  return result;
}

std::uint64_t fingerprint(const simulator::Report& report) noexcept {
  Fingerprint print;
  const auto add = [&print](double value) { print.add(&value, sizeof value); };
  for (const auto& sample : report.samples) {
    if (report.outcome == simulator::Outcome::kFinished && sample.t_s > report.race_time_s) break;
    add(sample.t_s);
    for (int i = 0; i < 3; ++i) {
      add(sample.state.p_WB[i]);
      add(sample.state.v_WB[i]);
      add(sample.state.w_WB_B[i]);
    }
    for (int i = 0; i < 4; ++i) {
      add(sample.state.q_WB.coeffs()[i]);
      add(sample.state.thrust_n[i]);
      add(sample.setpoint.thrust_rate_n_s[i]);
    }
  }
  for (const auto& pass : report.passes) {
    add(seconds(pass.time));
    add(pass.offset_m);
  }
  return print.value();
}

std::string reproduce_command(const Trial& trial) {
  const Cell& cell = *trial.cell;
  std::string command = "gatefield-sim --lockstep --scenario cells/" + cell.name + ".txt --seed " +
                        std::to_string(trial.seed) + " --speed " + fmt::format("{:.12g}", trial.speed_m_s) +
                        " --profile " + cell.profile;
  if (trial.planner_seed) command += " --planner-seed " + std::to_string(*trial.planner_seed);
  if (cell.laps) command += " --laps " + std::to_string(*cell.laps);
  if (cell.link.each_way_ms > 0) command += " --delay-ms " + brief(2.0 * cell.link.each_way_ms);
  if (cell.link.jitter_ms > 0) command += " --jitter-ms " + brief(cell.link.jitter_ms);
  if (cell.link.loss > 0) command += " --loss " + brief(cell.link.loss);
  if (cell.link.outage_s > 0) command += " --outage-s " + brief(cell.link.outage_s);
  return command;
}

}  // namespace gatefield::race
