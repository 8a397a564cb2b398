#pragma once

#include <Eigen/Geometry>
#include <array>

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
  std::array<Eigen::Vector2d, kRotors> rotor_position_B_m{
      Eigen::Vector2d{0.0771, -0.0771}, Eigen::Vector2d{-0.0771, 0.0771}, Eigen::Vector2d{0.0771, 0.0771},
      Eigen::Vector2d{-0.0771, -0.0771}};
  std::array<int, kRotors> rotor_spin{1, 1, -1, -1};  ///< sign of the rotor's reaction torque about +z
  double torque_per_thrust_m = 0.016;
  double thrust_min_n = 0.0;  ///< per rotor
  double thrust_max_n = 10.0;
  double thrust_rate_max_n_s = 30.0;  ///< |dT/dt| of the commanded thrust, per rotor
  double rotor_time_constant_s = 0.025;
  Eigen::Vector3d drag_kg_s{0.20, 0.20, 0.25};  ///< linear drag in the body frame: F_B = -diag(drag) v_B
  double collision_radius_m = 0.13;             ///< sphere around the centre of mass
};

/// State of the rigid body and its rotors. World frame W is ENU, z up.
struct QuadrotorState {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();            ///< body rates, rad/s
  Eigen::Vector4d thrust_n = Eigen::Vector4d::Zero();          ///< what each rotor gives now
  Eigen::Vector4d thrust_command_n = Eigen::Vector4d::Zero();  ///< what each rotor is asked for: the integral of u
};

using ThrustRates = Eigen::Vector4d;  ///< control input u = dT_command/dt per rotor, N/s

/// Says which field is wrong and why (mass, inertia, thrust against weight, time constants, rotor layout, ...).
Status validate(const QuadrotorModel& model);

/// Rotor thrusts that hold the vehicle still: m g / 4 each.
Eigen::Vector4d hover_thrust_n(const QuadrotorModel& model);

/// Torque about the centre of mass in B for the given rotor thrusts, N m.
Eigen::Vector3d rotor_torque_B(const QuadrotorModel& model, const Eigen::Vector4d& thrust_n);

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

}  // namespace gatefield
