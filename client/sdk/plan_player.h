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
/// Within an interval, thrusts and body rates go linearly from the value at the end of the interval before to the value
/// at its own end; in the first interval, thrusts come to its end along the thrust rate. After the last one they stay.
///
/// Thread-safe: no.   Real-time safe: yes.
class PlanPlayer {
 public:
  /// @pre command passed protocol::validate
  void take(const protocol::ThrustRateCommand& command) noexcept;

  /// What the plan that covers `now` says: its thrust rate then, its thrusts and body rates `period` later. Empty when
  /// none covers it.
  /// @pre period >= 0
  std::optional<Setpoint> at(Stamp now, Stamp period) const noexcept;

 private:
  struct Plan {
    Stamp start{0};
    Stamp step{0};
    Stamp end{0};
    int steps = 0;  // 0 = no plan
    std::array<Eigen::Vector4d, protocol::kMaxPlanSteps> thrust_rate_n_s;
    std::array<Eigen::Vector4d, protocol::kMaxPlanSteps> rotor_thrust_n;
    std::array<Eigen::Vector3d, protocol::kMaxPlanSteps> body_rates_rad_s;
  };
  static Setpoint point(const Plan& plan, Stamp now, Stamp period) noexcept;

  // Plans begin in the future when the server makes up for the delay, so a few are in hand at a time.
  std::array<Plan, 4> plans_;
  std::size_t newest_ = 0;  // index of the newest; older ones lie before it, cyclically
};

}  // namespace gatefield::sdk
