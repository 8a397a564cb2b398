#include "client/race/trial.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <numbers>

#include "client/race/files.h"
#include "common/plot/table.h"

namespace gatefield::race {
namespace {

std::string number(double value, const char* format = "%g") {
  if (!std::isfinite(value)) return "";
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string name_of(const std::string& cell, double speed_m_s, std::uint64_t seed) {
  return cell + " at " + number(speed_m_s) + " m/s, seed " + std::to_string(seed);
}

/// Cells of one line, as plot::csv_cell() writes them.
std::vector<std::string> split_csv(const std::string& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += c;
      ++i;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

bool read(const std::string& text, double* value) {
  if (text.empty()) {
    *value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  char* end = nullptr;
  *value = std::strtod(text.c_str(), &end);
  return *end == '\0';
}

template <typename Integer>
bool read_integer(const std::string& text, Integer* value, int base = 10) {
  const auto [stopped, code] = std::from_chars(text.data(), text.data() + text.size(), *value, base);
  return code == std::errc() && stopped == text.data() + text.size();
}

bool read(const std::string& text, Failure* failure) {
  *failure = Failure::kNone;
  if (text == name(Failure::kNone)) return true;
  for (const Failure one : kFailures)
    if (text == name(one)) {
      *failure = one;
      return true;
    }
  return false;
}

bool read(const std::string& text, Cause* cause) {
  *cause = Cause::kNone;
  if (text == name(Cause::kNone)) return true;
  for (const Cause one : kCauses)
    if (text == name(one)) {
      *cause = one;
      return true;
    }
  return false;
}

/// A column: its name, how it is written and how it is read.
struct Column {
  const char* name;
  std::function<std::string(const TrialResult&)> write;
  std::function<bool(const std::string&, TrialResult*)> read;
};

Column text(const char* name, std::string TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return r.*member; },
          [member](const std::string& s, TrialResult* r) {
            r->*member = s;
            return true;
          }};
}
Column decimal(const char* name, double TrialResult::*member, const char* format) {
  return {name, [member, format](const TrialResult& r) { return number(r.*member, format); },
          [member](const std::string& s, TrialResult* r) { return gatefield::race::read(s, &(r->*member)); }};
}
Column coordinate(const char* name, int axis) {
  return {name, [axis](const TrialResult& r) { return number(r.end_p_W[axis], "%.4f"); },
          [axis](const std::string& s, TrialResult* r) { return gatefield::race::read(s, &r->end_p_W[axis]); }};
}
template <typename Integer>
Column whole(const char* name, Integer TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return std::to_string(r.*member); },
          [member](const std::string& s, TrialResult* r) { return read_integer(s, &(r->*member)); }};
}
Column bits(const char* name, std::uint64_t TrialResult::*member) {
  return {name, [member](const TrialResult& r) { return hex(r.*member); },
          [member](const std::string& s, TrialResult* r) { return read_integer(s, &(r->*member), 16); }};
}

/// What a person looks for first stands first; what was measured by the wall clock, and differs from run to run, is
/// round_trip_*, solve_*, attempts, wall_s and host.
const std::vector<Column>& columns() {
  using R = TrialResult;
  static const std::vector<Column> all = {
      text("cell", &R::cell),
      decimal("speed_m_s", &R::speed_m_s, "%g"),
      whole("seed", &R::seed),
      whole("planner_seed", &R::planner_seed),
      {"success", [](const R& r) { return std::string(r.won() ? "1" : "0"); },
       [](const std::string& s, R*) { return s == "0" || s == "1"; }},
      {"failure", [](const R& r) { return std::string(name(r.failure)); },
       [](const std::string& s, R* r) { return gatefield::race::read(s, &r->failure); }},
      {"cause", [](const R& r) { return std::string(name(r.cause)); },
       [](const std::string& s, R* r) { return gatefield::race::read(s, &r->cause); }},
      decimal("belief_error_m", &R::belief_error_m, "%.3f"),
      decimal("belief_turn_deg", &R::belief_turn_deg, "%.1f"),
      decimal("seen_before_s", &R::seen_before_s, "%.2f"),
      text("outcome", &R::outcome),
      whole("gates", &R::gates_passed),
      whole("gates_total", &R::gates_total),
      decimal("time_s", &R::time_s, "%.3f"),
      decimal("top_speed_m_s", &R::top_speed_m_s, "%.4f"),
      decimal("mean_speed_m_s", &R::mean_speed_m_s, "%.4f"),
      decimal("clearance_m", &R::clearance_m, "%.4f"),
      whole("end_gate", &R::gate),
      whole("end_lap", &R::lap),
      coordinate("end_x_m", 0),
      coordinate("end_y_m", 1),
      coordinate("end_z_m", 2),
      whole("end_frame", &R::frame),
      decimal("round_trip_p50_ms", &R::round_trip_p50_ms, "%.3f"),
      decimal("round_trip_p99_ms", &R::round_trip_p99_ms, "%.3f"),
      decimal("solve_p50_ms", &R::solve_p50_ms, "%.3f"),
      bits("flight", &R::flight),
      bits("setup", &R::setup),
      bits("model", &R::model),
      text("profile", &R::profile),
      text("isa", &R::isa),
      text("host", &R::host),
      whole("attempts", &R::attempts),
      decimal("wall_s", &R::wall_s, "%.2f"),
      text("sentence", &R::sentence),
      text("reproduce", &R::reproduce),
  };
  return all;
}

/// No line of the table may break in two.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

std::uint64_t Trial::seed_of_planner() const noexcept {
  if (planner_seed) return *planner_seed;
  return cell->scenario.planner_seed.value_or(config::default_planner_seed(seed));
}
std::string Trial::name() const { return name_of(cell->name, speed_m_s, seed); }
std::string Trial::file_name() const { return cell->name + "-" + number(speed_m_s) + "-" + std::to_string(seed); }
std::string trial_name(const TrialResult& result) { return name_of(result.cell, result.speed_m_s, result.seed); }

Result<Shard> parse_shard(const std::string& text) {
  Shard shard;
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos || !read_integer(text.substr(0, slash), &shard.index) ||
      !read_integer(text.substr(slash + 1), &shard.count) || shard.count < 1 || shard.count > 100'000 ||
      shard.index < 1 || shard.index > shard.count)
    return Error{"'" + text + "' is no part of a campaign, expected INDEX/COUNT with 1 <= INDEX <= COUNT, e.g. 3/16"};
  return shard;
}

std::string server_key(const Cell& cell) {
  if (cell.perception != Perception::kLearned) return std::string(name(cell.perception)) + " for " + cell.name;
  return cell.rollouts ? cell.model + " with rollouts" : cell.model;
}

std::vector<Trial> trials_of(const Campaign& campaign, const Selection& selection) {
  std::vector<std::string> servers;
  std::uint64_t rounds = 0;
  for (const Cell& cell : campaign.cells) {
    const std::string key = server_key(cell);
    if (std::find(servers.begin(), servers.end(), key) == servers.end()) servers.push_back(key);
    rounds = std::max(rounds, selection.seeds_of(cell).count());
  }
  const auto shards = static_cast<std::uint64_t>(selection.shard.count);
  std::vector<Trial> trials;
  for (const std::string& server : servers)
    for (std::uint64_t round = 0; round < rounds; ++round) {
      // A round deals one trial of every cell and speed; the first one goes to another shard in each round.
      std::uint64_t place = round;
      for (const Cell& cell : campaign.cells)
        for (const double speed_m_s : cell.speeds_m_s) {
          const bool mine = place++ % shards + 1 == static_cast<std::uint64_t>(selection.shard.index);
          if (mine && server_key(cell) == server && round < selection.seeds_of(cell).count())
            trials.push_back({&cell, speed_m_s, selection.seeds_of(cell).first + round, selection.planner_seed});
        }
    }
  return trials;
}

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
  result.clearance_m = report.clearance_m;
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
                        std::to_string(trial.seed) + " --speed " + number(trial.speed_m_s, "%.12g") + " --profile " +
                        cell.profile;
  if (trial.planner_seed) command += " --planner-seed " + std::to_string(*trial.planner_seed);
  if (cell.laps) command += " --laps " + std::to_string(*cell.laps);
  if (cell.link.each_way_ms > 0) command += " --delay-ms " + number(2.0 * cell.link.each_way_ms);
  if (cell.link.jitter_ms > 0) command += " --jitter-ms " + number(cell.link.jitter_ms);
  if (cell.link.loss > 0) command += " --loss " + number(cell.link.loss);
  return command;
}

std::string csv_header() {
  std::string line;
  for (const Column& column : columns()) {
    if (!line.empty()) line += ',';
    line += column.name;
  }
  return line;
}

std::string csv_line(const TrialResult& result) {
  std::string line;
  for (const Column& column : columns()) {
    if (&column != &columns().front()) line += ',';
    line += plot::csv_cell(one_line(column.write(result)));
  }
  return line;
}

Result<TrialResult> parse_csv_line(const std::string& line) {
  const std::vector<std::string> cells = split_csv(line);
  if (cells.size() != columns().size())
    return Error{"there are " + std::to_string(cells.size()) + " columns, expected " +
                 std::to_string(columns().size())};
  TrialResult result;
  for (std::size_t i = 0; i < cells.size(); ++i)
    if (!columns()[i].read(cells[i], &result))
      return Error{std::string(columns()[i].name) + " is '" + cells[i] + "', which can't be read"};
  return result;
}

}  // namespace gatefield::race
