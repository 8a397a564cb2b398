#include "tests/support/rate_controller.h"

#include <algorithm>

namespace gatefield::test {

void RateController::command(Stamp now, const Eigen::Vector3d& rates_rad_s, double throttle) {
  rates_ = rates_rad_s;
  throttle_ = std::clamp(throttle, 0.0, 1.0);
  last_ = now;
  heard_ = true;
}

void RateController::arm_switch(Stamp now, bool on) {
  if (!on) {
    armed_ = false;
    failsafe_ = false;  // a failsafe lasts until the switch was off
    switch_was_off_ = true;
    integral_.setZero();
  } else if (switch_was_off_ && !armed_ && may_arm(now)) {
    armed_ = true;
  }
}

std::array<double, 4> RateController::step(Stamp now, const Eigen::Vector3d& gyro_rad_s, double dt_s) {
  const Eigen::Vector3d before = gyro_;
  gyro_ += dt_s / (options_.filter_s + dt_s) * (gyro_rad_s - gyro_);
  if (armed_ && !hears(now)) {
    armed_ = false;
    failsafe_ = true;
    switch_was_off_ = false;
  }
  if (!armed_) return {0, 0, 0, 0};

  const Eigen::Vector3d gains(options_.roll_pitch_gain, options_.roll_pitch_gain, options_.yaw_gain);
  const Eigen::Vector3d error = rates_ - gyro_;
  integral_ = (integral_ + options_.integral_per_s * dt_s * error).cwiseMax(-2.0).cwiseMin(2.0);
  const Eigen::Vector3d torque = gains.cwiseProduct(error + integral_ - options_.damping_s / dt_s * (gyro_ - before));

  // Roll to the right lifts the left, nose down lifts the rear, turning left speeds up what turns right.
  constexpr std::array<std::array<int, 3>, 4> kMix{{{-1, 1, 1}, {-1, -1, -1}, {1, 1, -1}, {1, -1, 1}}};
  std::array<double, 4> mix{};
  for (std::size_t i = 0; i < mix.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) mix[i] += kMix[i][axis] * torque[static_cast<Eigen::Index>(axis)];
  const auto [least, most] = std::minmax_element(mix.begin(), mix.end());
  const double range = *most - *least;
  const double scale = range > 1.0 ? 1.0 / range : 1.0;
  // Torque goes before thrust, as long as anybody wants to fly at all.
  const double throttle = std::clamp(throttle_, -*least * scale, 1.0 - *most * scale);
  std::array<double, 4> outputs{};
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const double wanted = throttle_ < kLowThrottle ? 0.0 : throttle + scale * mix[i];
    outputs[i] = std::clamp(options_.idle + (1 - options_.idle) * wanted, options_.idle, 1.0);
  }
  return outputs;
}

}  // namespace gatefield::test
