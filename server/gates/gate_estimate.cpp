#include "server/gates/gate_estimate.h"

#include <algorithm>
#include <cmath>

namespace gatefield::gates {
namespace {

// Lengths are those of the usual gate (gate_size()).
// Spread that a standing gate's estimate gains in a second (its variance grows with time): the error common to
// neighbouring frames.
constexpr double kCenterDrift_m = 0.08;
constexpr double kAxisDrift_rad = 0.12;
constexpr double kGate_sigmas = 3.5;
constexpr double kGateFloor_m = 0.10;
constexpr int kOutliersToRestart = 4;
constexpr double kOutliersAgree_m = 0.35;
constexpr int kMaxVotes = 10;
/// A measurement so near to what is then believed agrees with it. A belief that is still on its way binds nothing.
constexpr double kSteady_m = 0.15;

}  // namespace

double GateEstimate::center_sigma_m() const noexcept { return std::sqrt(state_.center_variance_m2); }
double GateEstimate::axis_sigma_rad() const noexcept { return std::sqrt(state_.axis_variance_rad2); }

void GateEstimate::restart(const GateMeasurement& measurement) noexcept {
  state_.started = true;
  state_.X_WG = measurement.X_WG;
  state_.center_variance_m2 = measurement.center_sigma_m * measurement.center_sigma_m;
  state_.axis_variance_rad2 = measurement.axis_sigma_rad * measurement.axis_sigma_rad;
  state_.outliers = 0;
  state_.votes = 1;
}

bool GateEstimate::fresh(Stamp stamp) const noexcept {
  return stamp >= state_.afar_stamp && stamp - state_.afar_stamp <= kFresh;
}

bool GateEstimate::established(Stamp stamp) const noexcept { return state_.from_afar >= kEstablished && fresh(stamp); }

bool GateEstimate::turns(const GateMeasurement& measurement) const noexcept {
  return std::abs(measurement.X_WG.linear().col(0).dot(state_.afar_axis_W)) < std::cos(kTurn_rad);
}

void GateEstimate::keep_what_is_seen_from_afar(const GateMeasurement& measurement, Stamp stamp, double size) noexcept {
  if (measurement.distance_m < size * kNear_m) return;
  const bool steady = (measurement.X_WG.translation() - state_.X_WG.translation()).norm() < size * kSteady_m;
  const int agreeing = fresh(stamp) ? state_.from_afar : 0;
  state_.from_afar = steady ? std::min(agreeing + 1, kEstablished) : 0;
  state_.afar_stamp = stamp;
  state_.afar_center_W = state_.X_WG.translation();
  state_.afar_axis_W = state_.X_WG.linear().col(0);
}

bool GateEstimate::update(const GateMeasurement& measurement, Stamp stamp, double size) noexcept {
  if (!state_.started) {
    restart(measurement);
    state_.stamp = stamp;
    keep_what_is_seen_from_afar(measurement, stamp, size);
    return true;
  }
  const double elapsed_s = std::clamp(seconds(stamp - state_.stamp), 0.0, 10.0);
  state_.stamp = std::max(stamp, state_.stamp);
  const double center_drift_m = size * kCenterDrift_m;
  state_.center_variance_m2 += center_drift_m * center_drift_m * elapsed_s;
  state_.axis_variance_rad2 += kAxisDrift_rad * kAxisDrift_rad * elapsed_s;

  const Eigen::Vector3d innovation = measurement.X_WG.translation() - state_.X_WG.translation();
  const double variance = state_.center_variance_m2 + measurement.center_sigma_m * measurement.center_sigma_m;
  const bool known = established(stamp), near = measurement.distance_m < size * kNear_m;
  const bool strays =
      known && near &&
      (turns(measurement) || (measurement.X_WG.translation() - state_.afar_center_W).norm() > size * kSlide_m);
  if (strays || innovation.norm() > kGate_sigmas * std::sqrt(variance) + size * kGateFloor_m) {
    const bool agrees = state_.outliers > 0 &&
                        (measurement.X_WG.translation() - state_.outlier_center_W).norm() < size * kOutliersAgree_m;
    state_.outliers = agrees ? state_.outliers + 1 : 1;
    state_.outlier_center_W = measurement.X_WG.translation();
    if (strays) return false;
    if (state_.outliers < (known && turns(measurement) ? kTurnedOutliersToRestart : kOutliersToRestart)) return false;
    restart(measurement);
    if (!near) state_.from_afar = 0;
    keep_what_is_seen_from_afar(measurement, stamp, size);
    return true;
  }
  state_.outliers = 0;

  const double gain = state_.center_variance_m2 / variance;
  state_.X_WG.translation() += gain * innovation;
  state_.center_variance_m2 *= 1.0 - gain;

  const double axis_gain =
      state_.axis_variance_rad2 / (state_.axis_variance_rad2 + measurement.axis_sigma_rad * measurement.axis_sigma_rad);
  Eigen::Vector3d measured_axis = measurement.X_WG.linear().col(0);
  const Eigen::Vector3d axis = state_.X_WG.linear().col(0);
  const bool agrees = measured_axis.dot(axis) >= 0;
  if (!agrees) measured_axis = -measured_axis;
  state_.votes = std::min(state_.votes + (agrees ? 1 : -1), kMaxVotes);
  const Eigen::Vector3d mean = (axis + axis_gain * (measured_axis - axis)).normalized();
  state_.axis_variance_rad2 *= 1.0 - axis_gain;

  const double sign = state_.votes < 0 ? -1.0 : 1.0;
  state_.votes = std::abs(state_.votes);

  // Roll is only known up to the shape's symmetry: take the newest frame's, turned onto the filtered axis.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(measurement.X_WG.linear().col(0), sign * mean);
  state_.X_WG.linear() = (turn * Eigen::Quaterniond(measurement.X_WG.linear())).normalized().toRotationMatrix();
  keep_what_is_seen_from_afar(measurement, stamp, size);
  return true;
}

}  // namespace gatefield::gates
