#include "client/simulator/rate_loop.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/simulator/plant.h"
#include "common/base/text.h"

namespace gatefield::simulator {
namespace {

constexpr double kFastest = 0.8;     // of the rotors' lag, see tuned_gains()
constexpr double kIdleShare = 0.02;  // of the range of thrust

double filter_share(double cutoff_hz) {
  return 1.0 - std::exp(-2.0 * std::numbers::pi * cutoff_hz * seconds(Plant::kStep));
}

// The largest share of `added`, up to 1, with which no two rotors are farther apart than `room_n`.
double fitting_share(const Eigen::Vector4d& base_n, const Eigen::Vector4d& added_n, double room_n) noexcept {
  double share = 1.0;
  for (Eigen::Index i = 0; i < kRotors; ++i)
    for (Eigen::Index j = 0; j < kRotors; ++j)
      if (const double apart_n = added_n[i] - added_n[j]; apart_n > 0)
        share = std::min(share, (room_n - (base_n[i] - base_n[j])) / apart_n);
  return std::max(share, 0.0);
}

}  // namespace

Result<RateLoopGains> tuned_gains(const QuadrotorModel& model, const Eigen::Vector3d& rate_time_constant_s) {
  const double lag_s = model.rotor_time_constant_s;
  RateLoopGains gains;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double goal_s = rate_time_constant_s[i];
    if (!(goal_s >= kFastest * lag_s))
      return Error::invalid("rate_time_constant_s[" + text(i) + "]", text(goal_s) + " s",
                            "at least " + text(kFastest * lag_s) + " s, " + text(kFastest) +
                                " of the rotors' time constant: no rate loop makes them faster");
    double omega_s = 1.71 / goal_s;
    gains.p_s[i] = omega_s * omega_s * lag_s;
    gains.d[i] = 1.5 * omega_s * lag_s - 1.0;
    if (gains.d[i] < 0) {
      gains.p_s[i] = 0.92 / (goal_s - 0.56 * lag_s);
      gains.d[i] = 0.0;
      omega_s = 1.5 * gains.p_s[i];
    }
    gains.i_s2[i] = 0.025 * gains.p_s[i] * omega_s;
  }
  return gains;
}

RateLoop::RateLoop(const QuadrotorModel& model, const RateLoopGains& gains)
    : model_(model),
      gains_(gains),
      idle_n_(model.thrust_min_n + kIdleShare * (model.thrust_max_n - model.thrust_min_n)),
      yaw_limit_nm_(gains.yaw_torque_share * model.torque_per_thrust_m * kRotors * model.thrust_max_n),
      gyro_share_(filter_share(gains.gyro_cutoff_hz)),
      derivative_share_(filter_share(gains.derivative_cutoff_hz)) {
  Eigen::Matrix4d wrench_from_thrust;
  for (Eigen::Index i = 0; i < kRotors; ++i) {
    const auto k = static_cast<std::size_t>(i);
    wrench_from_thrust.col(i) << 1.0, model.rotor_position_B_m[k].y(), -model.rotor_position_B_m[k].x(),
        model.rotor_spin[k] * model.torque_per_thrust_m;
  }
  thrust_from_wrench_ = wrench_from_thrust.inverse();
}

RateLoop::Mixed RateLoop::mix(double collective_n, const Eigen::Vector3d& torque_B) const noexcept {
  const double room_n = model_.thrust_max_n - idle_n_;
  Mixed mixed;
  Eigen::Vector4d thrust_n = collective_n * thrust_from_wrench_.col(0);
  const Eigen::Vector4d level_n = thrust_from_wrench_.middleCols<2>(1) * torque_B.head<2>();
  mixed.level_share = fitting_share(thrust_n, level_n, room_n);
  thrust_n += mixed.level_share * level_n;
  const Eigen::Vector4d yaw_n = torque_B.z() * thrust_from_wrench_.col(3);
  mixed.yaw_share = fitting_share(thrust_n, yaw_n, room_n);
  thrust_n += mixed.yaw_share * yaw_n;
  if (const double high_n = thrust_n.maxCoeff() - model_.thrust_max_n; high_n > 0) thrust_n.array() -= high_n;
  if (const double low_n = idle_n_ - thrust_n.minCoeff(); low_n > 0) thrust_n.array() += low_n;
  // What is left is rounding, or a layout whose collective thrust alone does not fit.
  mixed.thrust_n = thrust_n.cwiseMax(idle_n_).cwiseMin(model_.thrust_max_n);
  return mixed;
}

PlainVector4 RateLoop::update(double collective_n, const Eigen::Vector3d& w_asked_B,
                              const Eigen::Vector3d& gyro_B) noexcept {
  const Eigen::Vector3d before_B = rate_B_;
  rate_B_ += gyro_share_ * (gyro_B - rate_B_);
  acceleration_B_ += derivative_share_ * ((rate_B_ - before_B) / seconds(Plant::kStep) - acceleration_B_);

  const Eigen::Vector3d error_B = w_asked_B - rate_B_;
  const Eigen::Vector3d wanted_nm = model_.inertia_kg_m2.cwiseProduct(gains_.p_s.cwiseProduct(error_B) + integral_B_ -
                                                                      gains_.d.cwiseProduct(acceleration_B_));
  Eigen::Vector3d torque_B = wanted_nm;
  torque_B.z() = std::clamp(torque_B.z(), -yaw_limit_nm_, yaw_limit_nm_);
  const Mixed mixed = mix(collective_n, torque_B);

  for (Eigen::Index i = 0; i < 3; ++i) {
    const double share = i == 2 ? mixed.yaw_share : mixed.level_share;
    const bool cut = share < 1.0 || torque_B[i] != wanted_nm[i];
    if (cut && wanted_nm[i] * error_B[i] > 0) continue;
    integral_B_[i] += gains_.i_s2[i] * error_B[i] * seconds(Plant::kStep);
  }
  return mixed.thrust_n;
}

}  // namespace gatefield::simulator
