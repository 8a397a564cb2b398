#include "client/sdk/fallback.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gatefield::sdk {
namespace {

constexpr double kMaxClimb_m_s2 = 4.0;  // up and down
constexpr double kMaxRate_rad_s = 6.0;  // asked for while levelling out
constexpr double kThrustLag_s = 0.02;   // how fast the commanded thrust follows
constexpr double kStopThrust = 0.7;     // of all thrust, while stopping: the rest turns the vehicle
// Of other manoeuvres' gain: a little overshoot of the attitude costs less than the metre that it saves.
constexpr double kStopGain = 2.0;
constexpr double kTurning_s = 0.25;   // until it brakes
constexpr double kCommitted = 0.85;   // of the way to stop: a gate nearer than this is flown through
constexpr double kThrough_s = 0.2;    // to a gate: braking would only lead into its frame
constexpr double kStopped_m_s = 1.0;  // slower than this it holds its place
constexpr double kMixerShare = 0.1;   // of all thrust, what a flight controller's mixer needs to turn the vehicle

// How fast the body rates follow, 1/s: by rotors through a torque that lags, or by a rate loop of its own lag.
double rate_gain(const QuadrotorModel& model, const Actuation& actuation) {
  if (actuation.kind == Actuation::Kind::kBodyRates) return 1.0 / actuation.rate_time_constant_s.head<2>().maxCoeff();
  return 0.5 / model.rotor_time_constant_s;
}

}  // namespace

Fallback::Fallback(const QuadrotorModel& model, const Actuation& actuation) : model_(model), kind_(actuation.kind) {
  Eigen::Matrix4d wrench_from_thrust;
  for (Eigen::Index i = 0; i < kRotors; ++i) {
    const auto k = static_cast<std::size_t>(i);
    wrench_from_thrust.col(i) << 1.0, model.rotor_position_B_m[k].y(), -model.rotor_position_B_m[k].x(),
        model.rotor_spin[k] * model.torque_per_thrust_m;
  }
  // Least squares: a layout that cannot make some torque still gets the others.
  thrust_from_wrench_ = wrench_from_thrust.completeOrthogonalDecomposition().pseudoInverse();

  rate_gain_s_ = std::min(20.0, rate_gain(model, actuation));
  attitude_gain_s_ = rate_gain_s_ / 3.5;
  velocity_gain_s_ = std::min(2.0, attitude_gain_s_ / 3);
  height_gain_s2_ = velocity_gain_s_ * velocity_gain_s_ / 4;  // critically damped
  const double up_m_s2 = kStopThrust * kRotors * model.thrust_max_n / model.mass_kg;
  const double level_m_s2 = std::sqrt(std::max(0.0, up_m_s2 * up_m_s2 - kGravity_m_s2 * kGravity_m_s2));
  stop_m_s2_ = std::clamp(level_m_s2, 0.5 * kMaxBrake_m_s2, kMaxStop_m_s2);
}

Fallback::Fallback(const QuadrotorModel& model, const Actuation& actuation, KeepClear clear)
    : Fallback(model, actuation) {
  clear_ = std::move(clear);
}

Eigen::Vector4d Fallback::mix(double collective_n, const Eigen::Vector3d& torque_B) const noexcept {
  Eigen::Vector4d wrench(0, torque_B.x(), torque_B.y(), torque_B.z());
  Eigen::Vector4d turn_n = thrust_from_wrench_ * wrench;
  // What does not fit between the limits at any collective is scaled down...
  const double spread_n = turn_n.maxCoeff() - turn_n.minCoeff();
  const double room_n = model_.thrust_max_n - model_.thrust_min_n;
  if (spread_n > room_n) turn_n *= room_n / spread_n;
  Eigen::Vector4d thrust_n = collective_n * thrust_from_wrench_.col(0) + turn_n;
  // ...and the collective gives way to it: an upright vehicle can make up for height, a tumbling one can't.
  if (const double low_n = model_.thrust_min_n - thrust_n.minCoeff(); low_n > 0)
    thrust_n.array() += low_n;
  else if (const double high_n = thrust_n.maxCoeff() - model_.thrust_max_n; high_n > 0)
    thrust_n.array() -= high_n;
  return thrust_n.cwiseMax(model_.thrust_min_n).cwiseMin(model_.thrust_max_n);
}

Setpoint Fallback::update(Stamp now, const QuadrotorState& state) noexcept {
  if (!began_ || now < *began_) {  // a clock that goes back has begun anew
    began_ = now;
    hold_z_m_ = state.p_WB.z();
  }
  const double sinking_s = std::max(0.0, seconds(now - *began_ - kHold));
  Goal goal = stopping(state);
  goal.z_m = hold_z_m_ - kDescent_m_s * sinking_s;
  goal.v_W.z() = sinking_s > 0 ? -kDescent_m_s : 0.0;
  return fly(goal, state, stop_m_s2_);
}

double Fallback::stop_s(const QuadrotorState& state) const noexcept {
  return kTurning_s + 0.5 * state.v_WB.head<2>().norm() / stop_m_s2_;
}

/// Against the velocity, and around what lies ahead; from kStopped_m_s on out of a gate's space.
Fallback::Goal Fallback::stopping(const QuadrotorState& state) const noexcept {
  if (state.v_WB.head<2>().norm() < kStopped_m_s) {
    Goal goal;
    if (clear_) goal.v_W.head<2>() = clear_->drift(state.p_WB, false);
    return goal;
  }
  const Eigen::Vector2d steer_W = clear_ ? clear_->steer(state.p_WB, state.v_WB) : Eigen::Vector2d::Zero();
  const bool through = clear_ && clear_->passes(state.p_WB, state.v_WB, kThrough_s);
  return braking(state, steer_W, through ? 0.0 : kStopGain, stop_m_s2_);
}

Fallback::Goal Fallback::braking(const QuadrotorState& state, const Eigen::Vector2d& steer_W, double gain,
                                 double limit_m_s2) const noexcept {
  Goal goal;
  const Eigen::Vector2d v_W = state.v_WB.head<2>();
  const double left_m_s2 = std::sqrt(std::max(0.0, limit_m_s2 * limit_m_s2 - steer_W.squaredNorm()));
  const double brake_m_s2 = std::min(left_m_s2, gain * velocity_gain_s_ * v_W.norm());
  goal.v_W.head<2>() = v_W;
  goal.a_W.head<2>() = steer_W - brake_m_s2 * v_W.normalized();
  return goal;
}

bool Fallback::better_than_plan(const QuadrotorState& state, std::chrono::nanoseconds left) const noexcept {
  return clear_ && !clear_->passes(state.p_WB, state.v_WB, std::max(seconds(left), kCommitted * stop_s(state)));
}

Setpoint Fallback::toward(const Goal& goal, const QuadrotorState& state) const noexcept {
  return fly(goal, state, kMaxBrake_m_s2);
}

Setpoint Fallback::fly(const Goal& goal, const QuadrotorState& state, double limit_m_s2) const noexcept {
  Eigen::Vector3d a_W = velocity_gain_s_ * (goal.v_W - state.v_WB) + goal.a_W;
  a_W.z() += height_gain_s2_ * (goal.z_m - state.p_WB.z());
  a_W.z() = std::clamp(a_W.z(), -kMaxClimb_m_s2, kMaxClimb_m_s2);
  if (const double brake = a_W.head<2>().norm(); brake > limit_m_s2) a_W.head<2>() *= limit_m_s2 / brake;

  // Drag helps to brake; only along z it would take height away.
  const Eigen::Matrix3d R_WB = state.q_WB.normalized().toRotationMatrix();
  const Eigen::Vector3d drag_W = R_WB * model_.drag_kg_s.cwiseProduct(R_WB.transpose() * state.v_WB);
  Eigen::Vector3d f_W = model_.mass_kg * (a_W + Eigen::Vector3d(0, 0, kGravity_m_s2));
  f_W.z() += drag_W.z();
  f_W.z() = std::max(f_W.z(), 0.1 * model_.mass_kg * kGravity_m_s2);  // never ask to fly upside down
  return push(f_W, state);
}

Setpoint Fallback::push(const Eigen::Vector3d& f_W, const QuadrotorState& state) const noexcept {
  const Eigen::Matrix3d R_WB = state.q_WB.normalized().toRotationMatrix();
  // The short way from the body's z axis (0, 0, 1) to the wanted one, both in B.
  const Eigen::Vector3d up_B = R_WB.transpose() * f_W.normalized();
  const Eigen::Vector2d axis_B(-up_B.y(), up_B.x());
  const double sine = axis_B.norm();
  const double angle = std::atan2(sine, up_B.z());
  Eigen::Vector3d w_goal_B = Eigen::Vector3d::Zero();
  if (sine > 1e-6)
    w_goal_B.head<2>() = attitude_gain_s_ * angle / sine * axis_B;
  else if (up_B.z() < 0)
    w_goal_B.x() = attitude_gain_s_ * angle;
  if (const double rate = w_goal_B.norm(); rate > kMaxRate_rad_s) w_goal_B *= kMaxRate_rad_s / rate;

  // While the vehicle lies on its side or back, thrust pushes the wrong way: only as much as points up.
  const double collective_n = std::max(0.0, f_W.dot(R_WB.col(2)));
  return kind_ == Actuation::Kind::kBodyRates ? by_rates(collective_n, w_goal_B)
                                              : by_rotors(state, collective_n, w_goal_B);
}

Setpoint Fallback::by_rotors(const QuadrotorState& state, double collective_n,
                             const Eigen::Vector3d& w_goal_B) const noexcept {
  const Eigen::Vector3d& J = model_.inertia_kg_m2;
  const Eigen::Vector3d& w_B = state.w_WB_B;
  Eigen::Vector3d torque_B = J.cwiseProduct(rate_gain_s_ * (w_goal_B - w_B)) + w_B.cross(J.cwiseProduct(w_B));
  // Yaw has the least authority and matters least: it must not use up what roll and pitch need.
  const double yaw_limit = 0.2 * model_.torque_per_thrust_m * kRotors * model_.thrust_max_n;
  torque_B.z() = std::clamp(torque_B.z(), -yaw_limit, yaw_limit);

  Setpoint setpoint;
  setpoint.source = Setpoint::Source::kFallback;
  setpoint.rotor_thrust_n = mix(collective_n, torque_B);
  setpoint.collective_thrust_n = setpoint.rotor_thrust_n.sum();
  setpoint.body_rates_rad_s = w_goal_B;
  setpoint.thrust_rate_n_s = ((setpoint.rotor_thrust_n - state.thrust_command_n) / kThrustLag_s)
                                 .cwiseMax(-model_.thrust_rate_max_n_s)
                                 .cwiseMin(model_.thrust_rate_max_n_s);
  return setpoint;
}

Setpoint Fallback::by_rates(double collective_n, const Eigen::Vector3d& w_goal_B) const noexcept {
  const double all_n = kRotors * model_.thrust_max_n, least_n = kRotors * model_.thrust_min_n;
  const double hover_n = model_.mass_kg * kGravity_m_s2;
  // Of a strong vehicle the mixer's share would lift it; half of the weight is less than the law asks for when level.
  const double floor_n = std::max(least_n, std::min(kMixerShare * all_n, 0.5 * (least_n + hover_n)));
  Setpoint setpoint;
  setpoint.source = Setpoint::Source::kFallback;
  setpoint.collective_thrust_n = std::min(std::max(collective_n, floor_n), all_n);
  setpoint.body_rates_rad_s = w_goal_B;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (const double limit = model_.body_rate_max_rad_s[i]; limit > 0)
      setpoint.body_rates_rad_s[i] = std::clamp(w_goal_B[i], -limit, limit);
  return setpoint;
}

}  // namespace gatefield::sdk
