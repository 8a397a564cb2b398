#pragma once

#include <Eigen/Core>

#include "common/base/clock.h"

namespace gatefield::pilot {

/// What accelerates the vehicle beyond the model: wind, a mass or a drag other than told. The residual between measured
/// and predicted velocity, over the time between them, through a first-order low pass:
///   d += (1 - exp(-dt / T)) (r - d),  r = (v_measured - v_predicted) / dt,  |r| <= kMaxResidual, |d| <= kMax.
/// Steady wind is found whole. A wrong mass shows as an acceleration along the thrust, which turns with the vehicle; of
/// that, and of drag, the part is found that is slower than T. The estimate is added to the predicted start of a plan
/// and to every rollout.
/// Thread-safe: no (control step).   Real-time safe: yes.
class Disturbance {
 public:
  static constexpr double kMax_m_s2 = 4.0;           ///< more is a collision or a wrong state, not weather
  static constexpr double kMaxResidual_m_s2 = 15.0;  ///< one sample's
  static constexpr Stamp kLongestGap = std::chrono::milliseconds(100);  ///< longer predictions say nothing

  /// @param time_s  T; 0: nothing is estimated
  explicit Disturbance(double time_s = 0.0) noexcept : time_s_(time_s) {}

  bool wanted() const noexcept { return time_s_ > 0.0; }
  /// @param missed_W_m_s  v_measured - v_predicted after dt of prediction from a measured state. @pre dt > 0
  void observe(const Eigen::Vector3d& missed_W_m_s, Stamp dt) noexcept;
  const Eigen::Vector3d& acceleration_W_m_s2() const noexcept { return acceleration_W_; }
  void restore(const Eigen::Vector3d& acceleration_W_m_s2) noexcept { acceleration_W_ = acceleration_W_m_s2; }

 private:
  double time_s_;
  Eigen::Vector3d acceleration_W_ = Eigen::Vector3d::Zero();
};

}  // namespace gatefield::pilot
