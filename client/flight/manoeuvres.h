#pragma once

#include <optional>

#include "client/flight/supervisor.h"
#include "client/sdk/fallback.h"
#include "client/sdk/keep_clear.h"

namespace gatefield::flight {

/// What a phase means as a setpoint: thrust and body rates, or rotor thrusts, whichever the vehicle takes.
///
/// | phase | law |
/// | --- | --- |
/// | take_off | the fallback's law; the height asked for climbs at take_off_speed from where it stood |
/// | holding | the same, drawn back to where holding began (v* = k (p_0 - p), at most 1 m/s), out of a gate's space |
/// | hand_over | s times the plan's setpoint and 1 - s times the law with v* = 0; s goes from 0 to 1 in hand_over |
/// | racing | the plan's setpoint |
/// | braking | the law with v* = 0, height as it was; steers around frames that lie ahead, brakes with what is left |
/// | descending | as holding; the height asked for sinks at descent_m_s, slower in a gate's space |
/// | level_descent | see below |
/// | all others | none: motors idle, or somebody else flies |
///
/// Level descent has no position and no velocity. Its thrust is level_thrust of the weight along W's z, after a speed
/// that was known at its beginning has been taken away: sinking faster than kSink_m_s is braked with kMoreThrust,
/// rising is let go on with kLessThrust, each for as long as that takes without drag. Its attitude is the flight
/// controller's, where it tells one; else the last one known, turned on by the rates that were asked for since (a rate
/// loop follows them within its lag, so after a tenth of a second both know it is level).
///
/// Where the law flies, the error of the climb is integrated, up to kMaxLift_m_s2: before the first flight nobody knows
/// how much thrust a throttle gives, and a vehicle that is a quarter too weak must lift off, too.
///
/// Thread-safe: no.   Real-time safe: yes.   Errors: none.
class Manoeuvres {
 public:
  static constexpr double kSink_m_s = 1.0;
  static constexpr double kMoreThrust = 1.15, kLessThrust = 0.8;  ///< of the weight
  static constexpr double kMaxLift_m_s2 = 3.5;
  static constexpr double kMaxReturn_m_s = 1.0;  ///< back to where holding began

  /// @pre validate(model), validate(actuation), validate(course), validate(options)
  /// @param actuation  of the session: how the law drives the vehicle
  Manoeuvres(const QuadrotorModel& model, const Actuation& actuation, const Course& course,
             const SupervisorOptions& options);

  /// What to do from `now` on; empty: nothing (Actuator::hold()).
  /// @param state       the newest that can be flown by; empty where the phase needs one: nothing
  /// @param controller  what the flight controller said last, if anything
  /// @param plan        what the plan says; read in hand_over and racing only
  std::optional<sdk::Setpoint> setpoint(const Directive& directive, Stamp now, const std::optional<TimedState>& state,
                                        const std::optional<ControllerStatus>& controller,
                                        const sdk::Setpoint& plan) noexcept;

 private:
  void begin(const Directive& directive, Stamp now, const std::optional<TimedState>& state) noexcept;
  sdk::Fallback::Goal climb(double dt_s, const QuadrotorState& state) noexcept;
  sdk::Fallback::Goal hold(const QuadrotorState& state, bool sinking, double dt_s) noexcept;
  sdk::Fallback::Goal brake(const QuadrotorState& state) const noexcept;
  sdk::Setpoint fly(sdk::Fallback::Goal goal, const QuadrotorState& state, double dt_s) noexcept;
  sdk::Setpoint level(Stamp now, double dt_s, const std::optional<ControllerStatus>& controller) noexcept;

  SupervisorOptions options_;
  double mass_kg_;
  sdk::Fallback law_;
  sdk::KeepClear clear_;

  std::optional<Directive> directive_;  // of the last step
  Stamp last_{0};
  Eigen::Vector2d home_W_ = Eigen::Vector2d::Zero();  // where holding began
  double goal_z_m_ = 0.0, top_z_m_ = 0.0;
  double lift_m_s2_ = 0.0;      // the integral of the climb's error
  QuadrotorState level_state_;  // kLevelDescent: what is left of it
  double begin_v_z_m_s_ = 0.0;
  Eigen::Vector3d asked_rates_B_ = Eigen::Vector3d::Zero();
};

}  // namespace gatefield::flight
