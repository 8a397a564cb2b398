#pragma once

#include <array>
#include <optional>

#include "gatefield/sdk/client.h"

namespace gatefield::sdk {

/// Plays a commanded plan out by the client's clock.
///
/// Interval i of a plan holds during [plan_start + i plan_step, plan_start + (i + 1) plan_step). Of the plans that have
/// begun, the newest is played; it is over at plan_start + min(validity, steps * plan_step), and then no older one
/// takes its place. When none has begun, the newest begins at once, but no more than one step early.
///
/// A plan of rotor thrusts says where thrusts and body rates are at the end of each interval. Within an interval they
/// go linearly from the value at the end of the interval before to the value at its own end; in the first interval,
/// thrusts come to its end along the thrust rate. After the last one they stay.
///
/// A plan of body rates says what is commanded during each interval, all of it: nothing lies between two commands, and
/// the one that holds at `now` is played.
///
/// Thread-safe: no.   Real-time safe: yes.
class PlanPlayer {
 public:
  /// @pre command passed protocol::validate
  void take(const protocol::ThrustRateCommand& command) noexcept;

  /// What the plan that covers `now` says. Rotor thrusts: its thrust rate then, its thrusts and body rates `period`
  /// later. Body rates: its collective thrust and body rates then, and nothing of the rotors. Empty when none covers
  /// it.
  /// @pre period >= 0
  std::optional<Setpoint> at(Stamp now, Stamp period) const noexcept;

  /// When the newest plan is over; 0 when there was none.
  Stamp end() const noexcept { return plans_[newest_].end; }

 private:
  struct Plan {
    Stamp start{0};
    Stamp step{0};
    Stamp end{0};
    int steps = 0;  // 0 = no plan
    Actuation::Kind kind = Actuation::Kind::kRotorThrusts;
    std::array<Eigen::Vector4d, protocol::kMaxPlanSteps> thrust_rate_n_s;
    std::array<Eigen::Vector4d, protocol::kMaxPlanSteps> rotor_thrust_n;
    std::array<double, protocol::kMaxPlanSteps> collective_thrust_n;
    std::array<Eigen::Vector3d, protocol::kMaxPlanSteps> body_rates_rad_s;
  };
  static Setpoint point(const Plan& plan, Stamp now, Stamp period) noexcept;

  // Plans begin in the future when the server makes up for the delay, so a few are in hand at a time.
  std::array<Plan, 4> plans_;
  std::size_t newest_ = 0;  // index of the newest; older ones lie before it, cyclically
};

}  // namespace gatefield::sdk
