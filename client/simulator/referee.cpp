#include "client/simulator/referee.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

constexpr double kFrameSearch_m = 5.0;

double distance_to(const scene::Box& box, const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d p_O = box.X_WO.inverse() * p_W;
  return (p_O.cwiseAbs() - box.half_m).cwiseMax(0.0).norm();
}

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

Referee::Referee(const scene::World& world, std::vector<scene::Passage> passages, const Rules& rules,
                 const Eigen::Vector3d& p_WB)
    : gates_(world.gates), passages_(std::move(passages)), rules_(rules), last_p_WB_(p_WB), anchor_p_WB_(p_WB) {
  for (const auto& gate : gates_) frames_.push_back(scene::frame_boxes(gate));
  passes_.reserve(static_cast<std::size_t>(gates_total()));
}

int Referee::gates_total() const noexcept { return rules_.laps * static_cast<int>(passages_.size()); }
int Referee::expected_waypoint() const noexcept { return static_cast<int>(passes_.size() % passages_.size()); }
int Referee::lap() const noexcept { return static_cast<int>(passes_.size() / passages_.size()); }
const scene::Passage& Referee::expected() const noexcept { return passages_[passes_.size() % passages_.size()]; }

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

void Referee::update(Stamp time, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_WB,
                     const std::optional<Contact>& contact) {
  if (decided()) return;
  time_ = time;
  if (!p_WB.allFinite() || !v_WB.allFinite()) return decide(Outcome::kLostControl);

  judge_frames(p_WB);
  if (contact) {
    if (contact->with == Contact::With::kGate)
      decide(Outcome::kTouchedGate, waypoint_of(static_cast<std::size_t>(contact->index)));
    if (contact->with == Contact::With::kFloor) decide(Outcome::kTouchedFloor);
    if (contact->with == Contact::With::kClutter) decide(Outcome::kTouchedClutter, contact->index);
  }
  if (!decided()) judge_planes(time, p_WB, v_WB);
  last_p_WB_ = p_WB;
  if (decided()) return;

  if (!rules_.flight_volume.contains(p_WB)) return decide(Outcome::kOutOfBounds);
  if (time >= rules_.time_limit) return decide(Outcome::kTimeLimit);
  if ((p_WB - anchor_p_WB_).norm() > rules_.stall_distance_m) {
    anchor_p_WB_ = p_WB;
    anchor_time_ = time;
  }
  if (time - anchor_time_ >= rules_.stall_time || time - last_pass_time_ >= rules_.longest_gate_time)
    decide(Outcome::kStalled);
}

void Referee::judge_frames(const Eigen::Vector3d& p_WB) {
  for (std::size_t i = 0; i < gates_.size(); ++i) {
    if ((gates_[i].X_WG.translation() - p_WB).norm() > kFrameSearch_m) continue;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const auto& box : frames_[i]) nearest_m = std::min(nearest_m, distance_to(box, p_WB));
    clearance_m_ = std::min(clearance_m_, nearest_m - rules_.vehicle_radius_m);
    if (nearest_m < rules_.vehicle_radius_m) decide(Outcome::kTouchedGate, waypoint_of(i));
  }
}

void Referee::judge_planes(Stamp time, const Eigen::Vector3d& p_WB, const Eigen::Vector3d& v_WB) {
  for (std::size_t i = 0; i < gates_.size(); ++i) {
    const scene::Gate& gate = gates_[i];
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
      passes_.push_back({time, lap(), expected_waypoint(), offset_m, v_WB.norm()});
      last_pass_time_ = time;
      passed_by_ = false;
      if (static_cast<int>(passes_.size()) == gates_total()) decide(Outcome::kFinished);
      return;
    }
    if (is_expected) passed_by_ = right_way && offset_m < rules_.pass_by_radius_m;
  }
  const double x_G_m = (gates_[expected().gate].X_WG.inverse() * p_WB).x();
  if (passed_by_ && (expected().along_x ? x_G_m : -x_G_m) > rules_.miss_distance_m)
    decide(Outcome::kMissedGate, expected_waypoint());
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
             fixed(seconds(time_), 2) + " s";
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
