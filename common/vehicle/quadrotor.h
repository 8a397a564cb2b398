#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>

#include "common/base/plain.h"
#include "common/base/result.h"

namespace gatefield {

inline constexpr int kRotors = 4;
inline constexpr double kGravity_m_s2 = 9.81;

/// What a quadrotor is. SI units; frame B is FLU (x forward, y left, z up), rotors push along +z.
/// Defaults: the 0.83 kg vehicle of the project's experiments, X layout, rotors front right, rear left, front left,
/// rear right.
struct QuadrotorModel {
  double mass_kg = 0.83;
  Eigen::Vector3d inertia_kg_m2{3.1e-3, 3.1e-3, 5.0e-3};  ///< principal moments
  std::array<PlainVector2, kRotors> rotor_position_B_m{PlainVector2{0.0771, -0.0771}, PlainVector2{-0.0771, 0.0771},
                                                       PlainVector2{0.0771, 0.0771}, PlainVector2{-0.0771, -0.0771}};
  std::array<int, kRotors> rotor_spin{1, 1, -1, -1};  ///< sign of the rotor's reaction torque about +z
  double torque_per_thrust_m = 0.016;
  double thrust_min_n = 0.0;  ///< per rotor
  double thrust_max_n = 10.0;
  double thrust_rate_max_n_s = 30.0;  ///< |dT/dt| of the commanded thrust, per rotor
  double rotor_time_constant_s = 0.025;
  Eigen::Vector3d drag_kg_s{0.20, 0.20, 0.25};  ///< linear drag in the body frame: F_B = -diag(drag) v_B
  double collision_radius_m = 0.13;             ///< sphere around the centre of mass
  /// Most that may be asked for about each axis; 0: the planner's own limit.
  Eigen::Vector3d body_rate_max_rad_s = Eigen::Vector3d::Zero();
};

/// State of the rigid body and its rotors. World frame W is ENU, z up.
struct QuadrotorState {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  PlainQuaternion q_WB = PlainQuaternion::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();      ///< body rates, rad/s
  PlainVector4 thrust_n = PlainVector4::Zero();          ///< what each rotor gives now
  PlainVector4 thrust_command_n = PlainVector4::Zero();  ///< what each rotor is asked for: the integral of u
};

using ThrustRates = PlainVector4;  ///< control input u = dT_command/dt per rotor, N/s

/// The longest step that a planner integrates over (Profile::step_s ends there).
inline constexpr double kLongestStep_s = 0.2;

/// Says which field is wrong and why. With m the mass and a the longest arm (distance of a rotor from the centre):
///   - each number in its own range, and more thrust than 1.1 times the weight;
///   - inertia: 0.01 m a^2 to 10 m a^2 about each axis, radii of gyration of a tenth of the arm to three arms (drones
///     have about a half), and no moment above the sum of the two others (the triangle rule of every rigid body:
///     Jx + Jy - Jz = 2 * integral of z^2 dm >= 0), to a millionth;
///   - drag: at most m / kLongestStep_s along each axis. The planner's drag is explicit, v' = v (1 - drag dt / m):
///     beyond that bound one step would turn the speed around, and beyond twice of it the steps would grow without end;
///   - a mixer that makes all of thrust and torques: the wrench of the thrusts T is W T with the columns
///     (1, y_i / a, -x_i / a, spin_i), and the smallest singular value of W is at least kMinAuthority of the largest.
///     Rotors on one line, two that share place and spin, spins that are all equal, or that say nothing which the
///     places don't say already (both on the left one way) are refused;
///   - a torque per thrust of at least a / 1000, so that the heading can be held;
///   - a hover within limits: W T = (m g, 0, 0, 0) has all T in [thrust_min, thrust_max].
/// Errors: kInvalid with the field ("quadrotor.mass_kg").
/// Thread-safe: yes.   Real-time safe: no.
Status validate(const QuadrotorModel& model);
inline constexpr double kMinAuthority = 0.05;

/// Mends principal moments that break the triangle rule by rounding: data sheets round each to two or three digits, and
/// of a flat body's Jz = Jx + Jy something is left over (a published Crazyflie: 2.89e-5 against twice 1.43e-5, 1.05 %).
/// A moment that is at most kRoundedInertia above the sum of the others is set to that sum. Larger contradictions stay,
/// for validate() to refuse.
/// @return  a sentence that says what was changed; empty: nothing was
std::optional<std::string> mend_inertia(QuadrotorModel* model);
inline constexpr double kRoundedInertia = 0.02;

/// Rotor thrusts that hold the vehicle still: m g / 4 each.
PlainVector4 hover_thrust_n(const QuadrotorModel& model);

/// Torque about the centre of mass in B for the given rotor thrusts, N m.
Eigen::Vector3d rotor_torque_B(const QuadrotorModel& model, const PlainVector4& thrust_n);

/// Force (W, without gravity) and torque (B, without the gyroscopic term) that rotors and drag put on the body.
struct Wrench {
  Eigen::Vector3d force_W;
  Eigen::Vector3d torque_B;
};
Wrench aerodynamic_wrench(const QuadrotorModel& model, const QuadrotorState& state,
                          const Eigen::Vector3d& wind_W = Eigen::Vector3d::Zero());

/// Exact solution of the rotors over a step of constant u: the command is a ramp that stops at its limits, the thrust
/// follows it with a first-order lag. (The lag is solved for the clamped ramp's average slope, exact unless a limit is
/// hit.)
void step_rotors(const QuadrotorModel& model, const ThrustRates& u, double dt_s, QuadrotorState* state) noexcept;

/// Reference dynamics: one step of length dt, classic RK4 on the rigid body with the rotors solved exactly at the stage
/// times. Used as the truth that kernels are tested against. Double precision, readable, not fast.
/// Thread-safe: yes.   Real-time safe: yes.
QuadrotorState step_reference(const QuadrotorModel& model, const QuadrotorState& state, const ThrustRates& u,
                              double dt_s) noexcept;

/// The planner's discretisation, in double precision: the readable reference of server/kernels/rollout.
/// Over dt, with the mean of old and new thrust from (2) on:
///   (1) rotors exactly (step_rotors);
///   (2) body rates: explicit torque, gyroscopic term at the old rates;
///   (3) attitude by the exponential map of the mean body rate;
///   (4) velocity with the thrust along the mid-step attitude and drag at the old velocity;
///   (5) position by the mean of old and new velocity.
/// Error against step_reference over a fixed time is O(dt) (drag and gyroscopic term at the old values);
/// at dt = 0.03 s and 6 rad/s a few cm over 0.6 s.
QuadrotorState step_planner(const QuadrotorModel& model, const QuadrotorState& state, const ThrustRates& u,
                            double dt_s) noexcept;

/// (3) to (5) alone, from the means of body rates and of collective thrust over the step.
/// @param after  its attitude, velocity and position are written
void move_body(const QuadrotorModel& model, const QuadrotorState& before, const Eigen::Vector3d& mean_w_WB_B,
               double mean_thrust_n, double dt_s, QuadrotorState* after) noexcept;

}  // namespace gatefield
