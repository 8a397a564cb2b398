#pragma once

#include <Eigen/Geometry>

#include "common/base/clock.h"

namespace gatefield::gates {

/// One frame's word on where a gate is.
struct GateMeasurement {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  double center_sigma_m = 0.1;
  double axis_sigma_rad = 0.1;
  double distance_m = 1e3;  ///< from the camera to the gate at the capture; far when nobody says
};

/// Centre and axis of one gate, filtered over frames: a Kalman filter with one variance for the centre and one for the
/// axis, a little process noise (frames of one approach err alike, and the nearer ones must count), and a test against
/// outliers that gives way when the outliers agree among themselves. With P the variance of what is believed, R that
/// of the measurement, t seconds after the one before (constants in gate_estimate.cpp):
///   P += drift^2 t                                          at most 10 s of it
///   outlier    |c_measured - c| > 3.5 sqrt(P + R) + 0.1 m   left out; the fourth in a row within 0.35 m of the one
///                                                           before it is believed from then on
///   else       k = P / (P + R),  c += k (c_measured - c),  P *= 1 - k;  the axis likewise, with a variance of its own
/// Near a gate less of it is in the image, and other openings look like it: the room between its legs, a gate behind.
/// So from nearer than kNear_m, what kEstablished measurements in a row from farther off agreed on (kFresh) isn't given
/// up: a measurement that lies more than kSlide_m from what was believed at kNear_m, or turns that axis by more than
/// kTurn_rad, is an outlier, and however many agree, they are not believed. From farther off, outliers that would turn
/// an established axis by more than kTurn_rad begin anew after kTurnedOutliersToRestart.
/// Frames W and G (x through the opening); metres, radians.
/// An axis and its opposite are the same gate; which of them is the passing direction is the measurements' to say, each
/// with one vote. (Far away the error of a turned gate's axis can reach beyond 90 degrees from the course's direction,
/// and the caller then names the wrong one: that first word must not last.)
/// Thread-safe: no.   Real-time safe: yes.
class GateEstimate {
 public:
  static constexpr double kNear_m = 2.5;
  static constexpr double kSlide_m = 0.35;
  static constexpr double kTurn_rad = 0.8;
  static constexpr int kEstablished = 8;
  static constexpr Stamp kFresh = std::chrono::seconds(2);
  static constexpr int kTurnedOutliersToRestart = 12;

  /// @param size  gate_size(): lengths are those of the usual gate times this
  /// @return false when the measurement was set aside as an outlier
  bool update(const GateMeasurement& measurement, Stamp stamp, double size = 1.0) noexcept;

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
    // What was seen from farther than kNear_m.
    int from_afar = 0;  ///< measurements taken, in a row without a gap of kFresh
    Stamp afar_stamp{0};
    Eigen::Vector3d afar_center_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d afar_axis_W = Eigen::Vector3d::UnitX();
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) noexcept { state_ = state; }

 private:
  void restart(const GateMeasurement& measurement) noexcept;
  bool fresh(Stamp stamp) const noexcept;
  /// Whether enough was seen from afar, not long before.
  bool established(Stamp stamp) const noexcept;
  bool turns(const GateMeasurement& measurement) const noexcept;
  void keep_what_is_seen_from_afar(const GateMeasurement& measurement, Stamp stamp, double size) noexcept;

  State state_;
};

}  // namespace gatefield::gates
