#pragma once

#include <Eigen/Core>

#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// How a rate loop is set. Per axis of B (x, y, z), in angular acceleration, so that a heavier vehicle has the same
/// ones.
struct RateLoopGains {
  Eigen::Vector3d p_s = Eigen::Vector3d::Zero();   ///< rad/s^2 per rad/s of error
  Eigen::Vector3d i_s2 = Eigen::Vector3d::Zero();  ///< rad/s^2 per rad of integrated error
  Eigen::Vector3d d = Eigen::Vector3d::Zero();     ///< rad/s^2 per rad/s^2 of the measured rate
  double gyro_cutoff_hz = 100.0;                   ///< first order, before everything
  double derivative_cutoff_hz = 100.0;             ///< first order, of the D part alone
  double yaw_torque_share = 0.16;  ///< most torque about z, of what all rotors at full thrust had together
};

/// Gains with which 63 % of a small step comes in as told, with about 7 % of overshoot where the rotors set the pace:
/// the loop P / (s (tau_r s + 1) + D s + P) with the rotors' lag tau_r, kept at a damping of 0.75.
///   omega = 1.71 / T,  P = omega^2 tau_r,  D = 1.5 omega tau_r - 1   (T up to 2.57 tau_r)
///   P = 0.92 / (T - 0.56 tau_r),  D = 0                              (slower: the rotors matter less and less)
///   I = 0.025 P omega, with omega = 1.5 P for the slower ones
/// Measured against the loop and plant here: T is met within 10 % (a test).
/// @param rate_time_constant_s  T about x, y, z
/// Errors: a T below 0.8 tau_r: no gains make rotors that fast (Error::field rate_time_constant_s[i]).
Result<RateLoopGains> tuned_gains(const QuadrotorModel& model, const Eigen::Vector3d& rate_time_constant_s);

/// The inner loop of a flight controller, as the simulator has it: what it makes of collective thrust and body rates,
/// with an integral, filters and a mixer that comes to its limits. On purpose another thing than the first-order lags
/// that a planner reckons with.
///
/// One step of h = Plant::kStep:
///   gyro      g += (1 - exp(-2 pi f h)) (w - g)
///   torque    J (P (w* - g) + I sum (w* - g) h - D g'), g' low-passed; about z limited
///   thrusts   what the mixer gives (below), held until the next step
/// The integral of an axis stands still while its torque is cut and the error would wind it up further.
///
/// Mixer: the wrench's thrusts by the inverse of the layout. When they don't fit between idling (2 % above the least)
/// and full thrust: the turn about z is cut first, then roll and pitch together; then the collective thrust is moved to
/// where all rotors fit. So a vehicle that is asked for no thrust, or for all of it, still turns.
///
/// It knows the vehicle as told, not as it is. Thread-safe: no.   Real-time safe: update() yes.
class RateLoop {
 public:
  /// @pre validate(model).ok()
  RateLoop(const QuadrotorModel& model, const RateLoopGains& gains);

  /// One step.
  /// @param collective_n  of all rotors together
  /// @param w_asked_B     body rates that are asked for, rad/s
  /// @param gyro_B        body rates as measured now, rad/s
  /// @return what each rotor is asked for, N, between idling and full thrust
  PlainVector4 update(double collective_n, const Eigen::Vector3d& w_asked_B, const Eigen::Vector3d& gyro_B) noexcept;

 private:
  struct Mixed {
    PlainVector4 thrust_n;
    double level_share, yaw_share;  ///< how much of the torques about x and y, and about z, the rotors can make
  };
  Mixed mix(double collective_n, const Eigen::Vector3d& torque_B) const noexcept;

  QuadrotorModel model_;
  RateLoopGains gains_;
  Eigen::Matrix4d thrust_from_wrench_;  ///< (collective, torque_B) -> rotor thrusts
  double idle_n_, yaw_limit_nm_;
  double gyro_share_, derivative_share_;  ///< of the way to its input that a filter goes in a step
  Eigen::Vector3d rate_B_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_B_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d integral_B_ = Eigen::Vector3d::Zero();  ///< rad/s^2
};

}  // namespace gatefield::simulator
