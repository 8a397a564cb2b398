#include "server/perception/gate_estimate.h"

#include <algorithm>
#include <cmath>

namespace gatefield::perception {
namespace {

// Spread that a standing gate's estimate gains per second: the error common to neighbouring frames.
constexpr double kCenterDrift_m = 0.08;
constexpr double kAxisDrift_rad = 0.12;
constexpr double kGate_sigmas = 3.5;
constexpr double kGateFloor_m = 0.10;
constexpr int kOutliersToRestart = 4;
constexpr double kOutliersAgree_m = 0.35;
constexpr int kMostVotes = 10;

}  // namespace

double GateEstimate::center_sigma_m() const noexcept { return std::sqrt(center_variance_); }
double GateEstimate::axis_sigma_rad() const noexcept { return std::sqrt(axis_variance_); }

void GateEstimate::restart(const GateMeasurement& measurement) noexcept {
  started_ = true;
  X_WG_ = measurement.X_WG;
  center_variance_ = measurement.center_sigma_m * measurement.center_sigma_m;
  axis_variance_ = measurement.axis_sigma_rad * measurement.axis_sigma_rad;
  outliers_ = 0;
  votes_ = 1;
}

bool GateEstimate::update(const GateMeasurement& measurement, Stamp stamp) noexcept {
  if (!started_) {
    restart(measurement);
    stamp_ = stamp;
    return true;
  }
  const double elapsed_s = std::clamp(seconds(stamp - stamp_), 0.0, 10.0);
  stamp_ = std::max(stamp, stamp_);
  center_variance_ += kCenterDrift_m * kCenterDrift_m * elapsed_s;
  axis_variance_ += kAxisDrift_rad * kAxisDrift_rad * elapsed_s;

  const Eigen::Vector3d innovation = measurement.X_WG.translation() - X_WG_.translation();
  const double variance = center_variance_ + measurement.center_sigma_m * measurement.center_sigma_m;
  if (innovation.norm() > kGate_sigmas * std::sqrt(variance) + kGateFloor_m) {
    const bool agrees = outliers_ > 0 && (measurement.X_WG.translation() - outlier_center_W_).norm() < kOutliersAgree_m;
    outliers_ = agrees ? outliers_ + 1 : 1;
    outlier_center_W_ = measurement.X_WG.translation();
    if (outliers_ < kOutliersToRestart) return false;
    restart(measurement);
    return true;
  }
  outliers_ = 0;

  const double gain = center_variance_ / variance;
  X_WG_.translation() += gain * innovation;
  center_variance_ *= 1.0 - gain;

  const double axis_gain = axis_variance_ / (axis_variance_ + measurement.axis_sigma_rad * measurement.axis_sigma_rad);
  Eigen::Vector3d measured_axis = measurement.X_WG.linear().col(0);
  const Eigen::Vector3d axis = X_WG_.linear().col(0);
  const bool agrees = measured_axis.dot(axis) >= 0;
  if (!agrees) measured_axis = -measured_axis;
  votes_ = std::min(votes_ + (agrees ? 1 : -1), kMostVotes);
  const Eigen::Vector3d mean = (axis + axis_gain * (measured_axis - axis)).normalized();
  axis_variance_ *= 1.0 - axis_gain;

  const double sign = votes_ < 0 ? -1.0 : 1.0;
  votes_ = std::abs(votes_);

  // Roll is only known up to the shape's symmetry: take the newest frame's, turned onto the filtered axis.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(measurement.X_WG.linear().col(0), sign * mean);
  X_WG_.linear() = (turn * Eigen::Quaterniond(measurement.X_WG.linear())).normalized().toRotationMatrix();
  return true;
}

}  // namespace gatefield::perception
