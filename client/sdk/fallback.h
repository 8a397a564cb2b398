#pragma once

#include <Eigen/Dense>
#include <optional>

#include "client/sdk/keep_clear.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "gatefield/sdk/client.h"

namespace gatefield::sdk {

/// What the vehicle does by itself when the plan has run out: brake as hard as it can and still turn, hold the height
/// for kHold, then descend at kDescent_m_s until it is told otherwise (the ground included: whoever owns the motors
/// switches them off there). Where it was told of the course, it steers around frames that lie ahead while it brakes,
/// and drifts out of a gate's space afterwards (KeepClear): by where gates are nominally, since it sees nothing.
///
/// A cascade, each stage at most a third as fast as the one it drives, so that slow rotors get slow gains:
///   acceleration  a_xy = k_v (v* - v)_xy, |a_xy| <= kMaxBrake; a_z = k_v (vz* - vz) + k_p (z* - z), limited
///   thrust        f = m (a + g e_z) + what drag takes along z
///   attitude      z_B onto f / |f| the short way: w* = k_R angle axis, yaw rate 0
///   torque        tau = J k_w (w* - w) + w x J w
///   rotors        T = mixer^-1 (f . z_B, tau), torque before collective at the limits
///   input         u = (T - T_command) / kThrustLag, clamped
///
/// A vehicle driven by body rates is asked for f . z_B and w*; torque and rotors are its flight controller's affair.
/// Its rates stay below its limits, and its collective thrust above a tenth of all that the rotors have, or, where that
/// is less, above the middle between the least and the weight: with less, a mixer has nothing to turn the vehicle with,
/// and with more, a strong vehicle could not sink.
///
/// After geometric control on SE(3) by Lee, Leok and McClamroch (CDC 2010), with the attitude reduced to the direction
/// of thrust: yaw has no goal here, and the error has no singularity but at 180 deg, where the body's x axis is taken.
///
/// Thread-safe: no.   Real-time safe: yes.
class Fallback {
 public:
  static constexpr std::chrono::milliseconds kHold{3000};
  static constexpr double kDescent_m_s = 0.5;

  /// @pre validate(model).ok() && validate(actuation).ok()
  explicit Fallback(const QuadrotorModel& model, const Actuation& actuation = {});
  /// @param clear  of the gates
  Fallback(const QuadrotorModel& model, const Actuation& actuation, KeepClear clear);

  /// Where the law flies to: a velocity, and a height that moves along with its z.
  struct Goal {
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
    double z_m = 0.0;
    Eigen::Vector3d a_W = Eigen::Vector3d::Zero();  ///< acceleration asked for on top, m/s^2
  };
  /// The law by itself, for who has other goals than to hold and descend: towards `goal`, level acceleration at most
  /// kMaxBrake. Knows no time.
  Setpoint toward(const Goal& goal, const QuadrotorState& state) const noexcept;
  /// Its lower half alone: turns z_B onto `f_W` and asks for as much of it, N. Reads attitude, body rates and
  /// thrust_command_n of the state, so it works where position and velocity are lost. @pre f_W is not zero
  Setpoint push(const Eigen::Vector3d& f_W, const QuadrotorState& state) const noexcept;
  /// Brakes on its way: against the level velocity, with `gain` times velocity_gain_s() of it, and around what lies
  /// ahead; what steering leaves of the limit brakes. The height is the caller's.
  /// @param steer_W  level acceleration around frames (KeepClear::steer()), at most `limit_m_s2`
  Goal braking(const QuadrotorState& state, const Eigen::Vector2d& steer_W, double gain,
               double limit_m_s2) const noexcept;
  /// Gain of the velocity in toward(), 1/s.
  double velocity_gain_s() const noexcept { return velocity_gain_s_; }
  static constexpr double kMaxBrake_m_s2 = 5.0;  ///< of toward(), 27 deg of tilt
  static constexpr double kMaxStop_m_s2 = 12.0;  ///< of update(), 51 deg of tilt; less by the vehicle's thrust

  /// A plan is flown: the next update() begins anew.
  void reset() noexcept { began_.reset(); }

  /// @param now    of a clock that goes back, the hold begins anew
  /// @param state  with thrust_command_n as what the rotors are asked for now (not read when driven by body rates)
  Setpoint update(Stamp now, const QuadrotorState& state) noexcept;

  /// Whether to begin now or to fly a plan to its end, which covers `left` more: that goes through a gate before
  /// anybody could have stopped.
  bool better_than_plan(const QuadrotorState& state, std::chrono::nanoseconds left) const noexcept;

 private:
  Goal stopping(const QuadrotorState& state) const noexcept;
  /// How long it takes to stop, as a way at this speed, s.
  double stop_s(const QuadrotorState& state) const noexcept;
  Setpoint fly(const Goal& goal, const QuadrotorState& state, double limit_m_s2) const noexcept;
  /// The part of the setpoint that the vehicle takes.
  Setpoint by_rotors(const QuadrotorState& state, double collective_n, const Eigen::Vector3d& w_goal_B) const noexcept;
  Setpoint by_rates(double collective_n, const Eigen::Vector3d& w_goal_B) const noexcept;
  Eigen::Vector4d mix(double collective_n, const Eigen::Vector3d& torque_B) const noexcept;

  QuadrotorModel model_;
  Actuation::Kind kind_;
  Eigen::Matrix4d thrust_from_wrench_;  // (collective, torque_B) -> rotor thrusts
  double rate_gain_s_, attitude_gain_s_, velocity_gain_s_, height_gain_s2_;
  double stop_m_s2_;  // level
  std::optional<KeepClear> clear_;
  std::optional<Stamp> began_;
  double hold_z_m_ = 0.0;
};

}  // namespace gatefield::sdk
