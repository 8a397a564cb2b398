#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/random.h"
#include "common/config/scenario.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// What the vehicle believes about itself: what it could know (JudgedVehicle::known()) with the scenario's errors.
///
/// White: drawn anew each time, normal and independent per axis (attitude: a turn about an axis in the body).
///
/// Lag: the state is the one of `lag` before, though it is sent as of now.
///
/// Drift: three first-order Gauss-Markov processes of correlation time T (Maybeck, "Stochastic Models, Estimation, and
/// Control", vol. 1, 1979, ch. 4.10), exact over any step:
///   x(t + dt) = a x(t) + sigma sqrt(1 - a^2) n,   a = exp(-dt / T),   begun with their own spread:
/// the velocity's error b per axis, the heading's rate of drift r, and the tilt about each level axis (which gravity
/// keeps from growing). Position and heading integrate theirs, so that states fit together:
///   psi' = r,   e' = (R(psi) - 1) v + b,   p_E = p + e,   v_E = R(psi) v + b,   q_E = R(psi) R(tilt) q.
/// With T well below t the heading's spread is sigma sqrt(2 T t), and the position's without a heading's error as well.
///
/// Jumps: at times of a Poisson process e and psi take a normal step, as when an estimator finds itself elsewhere on
/// its map.
///
/// Same seed and sequence of calls, same errors; one kind draws nothing of another's. Thread-safe: no.
/// Real-time safe: yes, but for the constructor.
class Estimator {
 public:
  Estimator(const config::StateNoise& noise, const config::EstimateErrors& errors, std::uint64_t seed);

  /// @param now  not before the last one's
  QuadrotorState estimate(Stamp now, const QuadrotorState& truth) noexcept;

  /// Where things are for whoever goes by the newest estimate: p_E = frame() * p_W. Without lag, tilt and white errors.
  const Eigen::Isometry3d& frame() const noexcept { return X_EW_; }

 private:
  struct Past {
    Stamp stamp{0};
    QuadrotorState state;
  };
  QuadrotorState lagged(Stamp now, const QuadrotorState& truth) noexcept;
  void drift(double dt_s, const Eigen::Vector3d& v_WB) noexcept;
  void jump(double dt_s) noexcept;
  static Eigen::Vector3d error(Random* random, double sigma) noexcept;

  config::StateNoise noise_;
  config::EstimateErrors errors_;
  bool wanders_;  // drifts or jumps
  Random white_, drifts_, jumps_;
  std::vector<Past> past_;  // cyclic
  std::size_t begin_ = 0, kept_ = 0;
  std::optional<Stamp> last_;
  double to_jump_s_ = 0.0;
  Eigen::Vector3d velocity_error_ = Eigen::Vector3d::Zero();  // b
  double yaw_rate_ = 0.0;                                     // r
  Eigen::Vector2d tilt_rad_ = Eigen::Vector2d::Zero();
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();  // e
  double yaw_rad_ = 0.0;                              // psi
  Eigen::Isometry3d X_EW_ = Eigen::Isometry3d::Identity();
};

}  // namespace gatefield::simulator
