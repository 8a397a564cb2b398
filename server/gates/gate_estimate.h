#pragma once

#include <Eigen/Geometry>

#include "common/base/clock.h"

namespace gatefield::gates {

/// One frame's word on where a gate is.
struct GateMeasurement {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  double center_sigma_m = 0.1;
  double axis_sigma_rad = 0.1;
};

/// Centre and axis of one gate, filtered over frames: a Kalman filter with one variance for the centre and one for the
/// axis, a little process noise (frames of one approach err alike, and the nearer ones must count), and a test against
/// outliers that gives way when the outliers agree among themselves. With P the variance of what is believed, R that of
/// the measurement, t seconds after the one before (constants in gate_estimate.cpp):
///   P += drift^2 t                                          at most 10 s of it
///   outlier    |c_measured - c| > 3.5 sqrt(P + R) + 0.1 m   left out; the fourth in a row within 0.35 m of the one
///                                                           before it is believed from then on
///   else       k = P / (P + R),  c += k (c_measured - c),  P *= 1 - k;  the axis likewise, with a variance of its own
/// Frames W and G (x through the opening); metres, radians.
/// An axis and its opposite are the same gate; which of them is the passing direction is the measurements' to say, each
/// with one vote. (Far away the error of a turned gate's axis can reach beyond 90 degrees from the course's direction,
/// and the caller then names the wrong one: that first word must not last.)
/// Thread-safe: no.   Real-time safe: yes.
class GateEstimate {
 public:
  /// @return false when the measurement was set aside as an outlier
  bool update(const GateMeasurement& measurement, Stamp stamp) noexcept;

  bool started() const noexcept { return state_.started; }
  const Eigen::Isometry3d& X_WG() const noexcept { return state_.X_WG; }
  double center_sigma_m() const noexcept;
  double axis_sigma_rad() const noexcept;

  /// All there is: to be written down, and set to what was.
  struct State {
    bool started = false;
    int votes = 0;  ///< for the axis as it stands, less those against it
    Stamp stamp{0};
    Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
    double center_variance_m2 = 1.0;
    double axis_variance_rad2 = 1.0;
    int outliers = 0;  ///< in a row, agreeing with each other
    Eigen::Vector3d outlier_center_W = Eigen::Vector3d::Zero();
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) noexcept { state_ = state; }

 private:
  void restart(const GateMeasurement& measurement) noexcept;

  State state_;
};

}  // namespace gatefield::gates
