#include "server/gates/gate_estimate.h"

#include <algorithm>
#include <cmath>

namespace gatefield::gates {
namespace {

// Spread that a standing gate's estimate gains in a second (its variance grows with time): the error common to
// neighbouring frames.
constexpr double kCenterDrift_m = 0.08;
constexpr double kAxisDrift_rad = 0.12;
constexpr double kGate_sigmas = 3.5;
constexpr double kGateFloor_m = 0.10;
constexpr int kOutliersToRestart = 4;
constexpr double kOutliersAgree_m = 0.35;
constexpr int kMaxVotes = 10;

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

bool GateEstimate::update(const GateMeasurement& measurement, Stamp stamp) noexcept {
  if (!state_.started) {
    restart(measurement);
    state_.stamp = stamp;
    return true;
  }
  const double elapsed_s = std::clamp(seconds(stamp - state_.stamp), 0.0, 10.0);
  state_.stamp = std::max(stamp, state_.stamp);
  state_.center_variance_m2 += kCenterDrift_m * kCenterDrift_m * elapsed_s;
  state_.axis_variance_rad2 += kAxisDrift_rad * kAxisDrift_rad * elapsed_s;

  const Eigen::Vector3d innovation = measurement.X_WG.translation() - state_.X_WG.translation();
  const double variance = state_.center_variance_m2 + measurement.center_sigma_m * measurement.center_sigma_m;
  if (innovation.norm() > kGate_sigmas * std::sqrt(variance) + kGateFloor_m) {
    const bool agrees =
        state_.outliers > 0 && (measurement.X_WG.translation() - state_.outlier_center_W).norm() < kOutliersAgree_m;
    state_.outliers = agrees ? state_.outliers + 1 : 1;
    state_.outlier_center_W = measurement.X_WG.translation();
    if (state_.outliers < kOutliersToRestart) return false;
    restart(measurement);
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
  return true;
}

}  // namespace gatefield::gates
