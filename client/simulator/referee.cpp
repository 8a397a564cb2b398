#include "client/simulator/referee.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

constexpr double kFrameSearch_m = 5.0;
constexpr double kEncounter_m = 0.5;  ///< a gate is left when no part of the hull is nearer to its corners

}  // namespace

const char* name(Outcome outcome) noexcept {
  switch (outcome) {
    case Outcome::kRunning:
      return "running";
    case Outcome::kFinished:
      return "finished";
    case Outcome::kTouchedGate:
      return "touched_gate";
    case Outcome::kTouchedFloor:
      return "touched_floor";
    case Outcome::kTouchedClutter:
      return "touched_clutter";
    case Outcome::kMissedGate:
      return "missed_gate";
    case Outcome::kWrongGate:
      return "wrong_gate";
    case Outcome::kWrongDirection:
      return "wrong_direction";
    case Outcome::kOutOfBounds:
      return "out_of_bounds";
    case Outcome::kTimeLimit:
      return "time_limit";
    case Outcome::kStalled:
      return "stalled";
    case Outcome::kLostControl:
      return "lost_control";
    case Outcome::kLinkLost:
      return "link_lost";
    case Outcome::kFlightControllerLost:
      return "flight_controller_lost";
    case Outcome::kInterrupted:
      return "interrupted";
  }
  return "unknown";
}

Referee::Referee(scene::World world, std::vector<scene::Passage> passages, const Rules& rules,
                 const Eigen::Vector3d& p_WB)
    : world_(std::move(world)),
      passages_(std::move(passages)),
      encounters_(world_.gates.size()),
      rules_(rules),
      last_p_WB_(p_WB),
      anchor_p_WB_(p_WB) {
  for (const auto& gate : world_.gates) frames_.push_back(scene::frame_boxes(gate));
  passes_.reserve(static_cast<std::size_t>(gates_total()));
}

int Referee::gates_total() const noexcept { return rules_.laps * static_cast<int>(passages_.size()); }
int Referee::expected_waypoint() const noexcept { return static_cast<int>(passes_.size() % passages_.size()); }
int Referee::lap() const noexcept { return static_cast<int>(passes_.size() / passages_.size()); }
const scene::Passage& Referee::expected() const noexcept { return passages_[passes_.size() % passages_.size()]; }

int Referee::retries() const noexcept {
  return std::accumulate(passes_.begin(), passes_.end(), 0,
                         [](int sum, const Pass& pass) { return sum + pass.misses; });
}

int Referee::missed_gates() const noexcept {
  const auto missed = std::count_if(passes_.begin(), passes_.end(), [](const Pass& pass) { return pass.misses > 0; });
  return static_cast<int>(missed) + (misses_ > 0 ? 1 : 0);
}

int Referee::waypoint_of(std::size_t gate) const noexcept {
  if (expected().gate == gate) return expected_waypoint();
  if (!passes_.empty() && passages_[static_cast<std::size_t>(passes_.back().waypoint)].gate == gate)
    return passes_.back().waypoint;
  const auto first = std::find_if(passages_.begin(), passages_.end(),
                                  [gate](const scene::Passage& passage) { return passage.gate == gate; });
  return static_cast<int>(first - passages_.begin());
}

void Referee::decide(Outcome outcome, int culprit) noexcept {
  if (decided()) return;
  outcome_ = outcome;
  culprit_ = culprit;
}

void Referee::stop(Outcome outcome, Stamp time) noexcept {
  if (decided()) return;
  time_ = time;
  decide(outcome);
}

void Referee::update(Stamp time, const QuadrotorState& state, const std::optional<Contact>& contact) {
  if (decided()) return;
  time_ = time;
  const Eigen::Vector3d& p_WB = state.p_WB;
  if (!p_WB.allFinite() || !state.v_WB.allFinite()) return decide(Outcome::kLostControl);

  const PlacedHull hull(rules_.hull, p_WB, state.q_WB);
  judge_frames(p_WB, hull);
  judge_surroundings(hull);
  if (contact) {
    if (contact->with == Contact::With::kGate)
      decide(Outcome::kTouchedGate, waypoint_of(static_cast<std::size_t>(contact->index)));
    if (contact->with == Contact::With::kFloor) decide(Outcome::kTouchedFloor);
    if (contact->with == Contact::With::kClutter) decide(Outcome::kTouchedClutter, contact->index);
  }
  if (!decided() && !passed_all()) judge_planes(time, p_WB, state.v_WB);
  last_p_WB_ = p_WB;
  if (decided()) return;
  if (passed_all()) return judge_run_out(time, p_WB);
  judge_progress(time, p_WB);
}

void Referee::judge_progress(Stamp time, const Eigen::Vector3d& p_WB) {
  if (!rules_.flight_volume.contains(p_WB)) return decide(Outcome::kOutOfBounds);
  if (time >= rules_.time_limit) return decide(Outcome::kTimeLimit);
  if ((p_WB - anchor_p_WB_).norm() > rules_.stall_distance_m) {
    anchor_p_WB_ = p_WB;
    anchor_time_ = time;
  }
  if (time - anchor_time_ >= rules_.stall_time || time - last_pass_time_ >= rules_.longest_gate_time)
    decide(Outcome::kStalled);
}

void Referee::judge_run_out(Stamp time, const Eigen::Vector3d& p_WB) {
  const scene::Gate& gate = world_.gates[passages_[static_cast<std::size_t>(passes_.back().waypoint)].gate];
  const double clear_m = std::max(rules_.run_out_m, 0.5 * gate.shape.thickness_m + rules_.hull.reach_m());
  if (std::abs((gate.X_WG.inverse() * p_WB).x()) < clear_m && time - last_pass_time_ < rules_.run_out_time) return;
  time_ = last_pass_time_;
  decide(Outcome::kFinished);
}

void Referee::judge_frames(const Eigen::Vector3d& p_WB, const PlacedHull& hull) {
  for (std::size_t i = 0; i < world_.gates.size(); ++i) {
    const scene::Gate& gate = world_.gates[i];
    Encounter& encounter = encounters_[i];
    const double from_center_m = (gate.X_WG.translation() - p_WB).norm();
    const double corner_m = gate.shape.outer_half_m * std::numbers::sqrt2;
    const bool near = from_center_m < corner_m + rules_.hull.reach_m() + kEncounter_m;
    if (!near) encounter = {};
    if (from_center_m > kFrameSearch_m && !near) continue;

    const double record_m = near ? encounter.clearance_m : clearance_m_;
    double nearest_m = record_m;
    for (const auto& box : frames_[i]) nearest_m = hull.nearest_m(box, nearest_m);
    clearance_m_ = std::min(clearance_m_, nearest_m);
    if (near) encounter.clearance_m = nearest_m;
    if (encounter.pass) passes_[*encounter.pass].clearance_m = encounter.clearance_m;
    if (nearest_m < 0.0) decide(Outcome::kTouchedGate, waypoint_of(i));
  }
}

void Referee::judge_surroundings(const PlacedHull& hull) {
  if (!hull.has_discs()) return;
  for (std::size_t i = 0; i < world_.boxes.size(); ++i)
    if (hull.nearest_m(world_.boxes[i], kHullError_m) < 0.0) decide(Outcome::kTouchedClutter, static_cast<int>(i));
  if (world_.has_floor && hull.discs_above_m(world_.floor_z_m) < 0.0) decide(Outcome::kTouchedFloor);
}

void Referee::judge_planes(Stamp time, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_WB) {
  for (std::size_t i = 0; i < world_.gates.size(); ++i) {
    const scene::Gate& gate = world_.gates[i];
    const Eigen::Isometry3d X_GW = gate.X_WG.inverse();
    const Eigen::Vector3d from_G = X_GW * last_p_WB_;
    const Eigen::Vector3d to_G = X_GW * p_WB;
    // The plane itself belongs to the far side, so that a path that ends on it crosses exactly once.
    const bool forwards = from_G.x() < 0 && to_G.x() >= 0;
    const bool backwards = from_G.x() >= 0 && to_G.x() < 0;
    if (!forwards && !backwards) continue;
    const double share = from_G.x() / (from_G.x() - to_G.x());
    const double offset_m = transverse_distance(gate.shape, from_G + share * (to_G - from_G));
    const bool through = offset_m < gate.shape.inner_half_m;

    const bool is_expected = i == expected().gate;
    const bool right_way = expected().along_x ? forwards : backwards;
    if (through && !is_expected) return decide(Outcome::kWrongGate, waypoint_of(i));
    if (through && !right_way) return decide(Outcome::kWrongDirection, waypoint_of(i));
    if (through) {
      encounters_[i].pass = passes_.size();
      passes_.push_back({time, lap(), expected_waypoint(), offset_m, v_WB.norm(), misses_, encounters_[i].clearance_m});
      last_pass_time_ = time;
      misses_ = 0;
      passed_by_ = attempt_missed_ = false;
      return;
    }
    if (is_expected) passed_by_ = right_way && offset_m < rules_.pass_by_radius_m;
  }
  const double x_G_m = (world_.gates[expected().gate].X_WG.inverse() * p_WB).x();
  const double beyond_m = expected().along_x ? x_G_m : -x_G_m;
  if (passed_by_ && !attempt_missed_) ++misses_;
  attempt_missed_ = passed_by_ || (attempt_missed_ && beyond_m > -rules_.new_attempt_m);
  if (passed_by_ && beyond_m > rules_.miss_distance_m) decide(Outcome::kMissedGate, expected_waypoint());
}

std::vector<double> Referee::lap_times_s() const {
  std::vector<double> times;
  Stamp begin{0};
  for (std::size_t i = passages_.size(); i <= passes_.size(); i += passages_.size()) {
    times.push_back(seconds(passes_[i - 1].time - begin));
    begin = passes_[i - 1].time;
  }
  return times;
}

std::string Referee::sentence() const {
  const std::string at = " at " + fixed(seconds(time_), 2) + " s";
  const std::string done =
      " after " + std::to_string(passes_.size()) + " of " + std::to_string(gates_total()) + " gates" + at;
  const std::string gate = "gate " + std::to_string(culprit_ + 1);
  const std::string expected = "gate " + std::to_string(expected_waypoint() + 1);
  switch (outcome_) {
    case Outcome::kRunning:
      return "running, " + std::to_string(passes_.size()) + " of " + std::to_string(gates_total()) + " gates" + at;
    case Outcome::kFinished:
      return "finished: " + std::to_string(gates_total()) + " of " + std::to_string(gates_total()) + " gates in " +
             fixed(seconds(time_), 2) + " s" +
             (missed_gates() > 0 ? ", " + std::to_string(missed_gates()) + " of them missed at first" : "");
    case Outcome::kTouchedGate:
      return "touched the frame of " + gate + done;
    case Outcome::kTouchedFloor:
      return "touched the floor" + done;
    case Outcome::kTouchedClutter:
      return "touched obstacle " + std::to_string(culprit_ + 1) + done;
    case Outcome::kMissedGate:
      return "missed " + gate + ", flew past beside it" + done;
    case Outcome::kWrongGate:
      return "flew through " + gate + " where " + expected + " was next" + done;
    case Outcome::kWrongDirection:
      return "flew through " + gate + " from behind" + done;
    case Outcome::kOutOfBounds:
      return "left the flight volume" + done;
    case Outcome::kTimeLimit:
      return "ran out of time" + done;
    case Outcome::kStalled:
      return "got stuck before " + expected + done;
    case Outcome::kLostControl:
      return "lost control" + done;
    case Outcome::kLinkLost:
      return "lost the server" + done;
    case Outcome::kFlightControllerLost:
      return "lost the flight controller" + done;
    case Outcome::kInterrupted:
      return "interrupted" + done;
  }
  return "unknown";
}

}  // namespace gatefield::simulator
