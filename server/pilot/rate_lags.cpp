#include "server/pilot/rate_lags.h"

#include <algorithm>
#include <cmath>

namespace gatefield::pilot {

RateLags::RateLags(const Actuation& told) noexcept {
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    axis.told_s = told.rate_time_constant_s[static_cast<Eigen::Index>(a)];
    for (std::size_t i = 0; i < kCandidates; ++i)
      axis.candidate_s[i] = axis.told_s * std::pow(kSpan, 2.0 * static_cast<double>(i) / (kCandidates - 1) - 1.0);
  }
}

void RateLags::follow(const RateCommand& command, Stamp dt) noexcept {
  const double dt_s = seconds(dt);
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    axis.asked_rad_s = command[static_cast<Eigen::Index>(a) + 1];
    for (std::size_t i = 0; i < kCandidates; ++i) {
      double& response = axis.response_rad_s[i];
      response += (1.0 - std::exp(-dt_s / axis.candidate_s[i])) * (axis.asked_rad_s - response);
    }
  }
}

void RateLags::observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept {
  const double weight = 1.0 - std::exp(-seconds(dt) / seconds(kMemory));
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    const double measured = w_WB_B[static_cast<Eigen::Index>(a)];
    for (std::size_t i = 0; i < kCandidates; ++i) {
      const double error = measured - axis.response_rad_s[i];
      axis.mean_square[i] += weight * (error * error - axis.mean_square[i]);
    }
    const double ahead = axis.asked_rad_s - axis.response_rad_s.back();
    axis.motion += weight * (ahead * ahead - axis.motion);
  }
  observed_ = std::min(observed_ + dt, kWarmUp);
}

void RateLags::interrupt(const Eigen::Vector3d& w_WB_B) noexcept {
  for (std::size_t a = 0; a < axes_.size(); ++a) axes_[a].response_rad_s.fill(w_WB_B[static_cast<Eigen::Index>(a)]);
}

std::optional<double> RateLags::lag_s(int axis_index) const noexcept {
  const Axis& axis = axes_[static_cast<std::size_t>(axis_index)];
  if (observed_ < kWarmUp || axis.motion < kLeastMotion_rad_s * kLeastMotion_rad_s) return std::nullopt;
  const auto& square = axis.mean_square;
  const auto i =
      static_cast<std::size_t>(std::distance(square.begin(), std::min_element(square.begin(), square.end())));
  if (i == 0 || i == kCandidates - 1) return axis.candidate_s[i];
  const double bend = square[i - 1] - 2.0 * square[i] + square[i + 1];
  const double off = bend > 0.0 ? 0.5 * (square[i - 1] - square[i + 1]) / bend : 0.0;
  return axis.candidate_s[i] * std::pow(kSpan, 2.0 * off / (kCandidates - 1));
}

bool RateLags::unlike_told() const noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    const auto lag = lag_s(axis);
    const double expected_s = kOfStep * axes_[static_cast<std::size_t>(axis)].told_s;
    if (lag && (*lag > kUnlike * expected_s || *lag < expected_s / kUnlike)) return true;
  }
  return false;
}

}  // namespace gatefield::pilot
