#pragma once

#include <Eigen/Core>

#include "common/base/clock.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// How much more (or less) than it is asked for a vehicle of collective thrust really gives: a battery, a thrust curve,
/// a mass other than told. What the measured velocity gained along the body's z beyond the prediction, over what thrust
/// was thought to give, through a first-order low pass:
///   k += (1 - exp(-dt / T)) (z . (v_measured - v_predicted)) / integral(thrust / m),  within [kLow, kHigh],
/// where the prediction was made with k. What is left across z is wind's (Disturbance).
/// Thread-safe: no (control step).   Real-time safe: yes.
class ThrustFactor {
 public:
  static constexpr double kTime_s = 0.4;
  static constexpr double kLow = 0.6, kHigh = 1.6;
  static constexpr double kMaxCorrection = 0.5;  ///< one sample's: more is a collision or a wrong state
  /// Less thrust than this part of the weight says nothing.
  static constexpr double kLeastThrust = 0.3;
  /// Farther from 1 than this, for kWarmUp of observing at least, it is told to people.
  static constexpr double kUnlike = 0.15;
  static constexpr Stamp kWarmUp = std::chrono::milliseconds(1500);

  /// @param missed_W_m_s  v_measured - v_predicted
  /// @param z_W           the body's z meanwhile, a unit vector
  /// @param push_m_s      integral of thrust / m over dt, without the factor
  void observe(const Eigen::Vector3d& missed_W_m_s, const Eigen::Vector3d& z_W, double push_m_s, Stamp dt) noexcept;
  /// The same from two states.
  /// @param begin      the state before, and @param predicted  what was predicted from it: thrusts as modelled in both
  /// @param v_WB       velocity that was measured in place of the predicted one
  void observe(const QuadrotorState& begin, const QuadrotorState& predicted, const Eigen::Vector3d& v_WB,
               double mass_kg, Stamp dt) noexcept;
  double value() const noexcept { return factor_; }
  /// Enough was seen to tell people of it.
  bool known() const noexcept { return observed_ >= kWarmUp; }
  bool unlike_told() const noexcept;

  struct State {
    double factor = 1.0;
    Stamp observed{0};
  };
  State state() const noexcept { return {factor_, observed_}; }
  void restore(const State& state) noexcept;

 private:
  double factor_ = 1.0;
  Stamp observed_{0};
};

/// The body's z between two states, a unit vector.
Eigen::Vector3d thrust_axis_W(const QuadrotorState& begin, const QuadrotorState& end) noexcept;

}  // namespace gatefield::pilot
