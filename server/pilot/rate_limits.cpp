#include "server/pilot/rate_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace gatefield::pilot {
namespace {

/// Geometric, rising, from `low` to `high`.
void spread(double low, double high, std::span<double> out) noexcept {
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = low * std::pow(high / low, static_cast<double>(i) / static_cast<double>(out.size() - 1));
}

}  // namespace

RateLimits::RateLimits(const Actuation& told, const Eigen::Vector3d& asked_at_most_rad_s) noexcept {
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    const auto i = static_cast<Eigen::Index>(a);
    const double lag_s = told.rate_time_constant_s[i];
    axis.asked_at_most_rad_s = asked_at_most_rad_s[i];
    spread(kLowest * asked_at_most_rad_s[i], asked_at_most_rad_s[i], axis.limit_rad_s);
    spread(lag_s / kLagSpan, lag_s * kLagSpan, axis.lag_s);
    spread(lag_s / kSlowest, lag_s * kSlowest, axis.free_lag_s);
    axis.bounded_lag_s = {lag_s / 1.5, lag_s};
    double acceleration_rad_s2 = asked_at_most_rad_s[i] / lag_s;
    for (double& bound : axis.acceleration_rad_s2) bound = acceleration_rad_s2 *= 0.5;
  }
}

void RateLimits::follow(const RateCommand& command, Stamp dt) noexcept {
  const double dt_s = seconds(dt);
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    const double asked = axis.asked_rad_s = command[static_cast<Eigen::Index>(a) + 1];
    double* response = axis.response_rad_s.data();
    for (const double lag_s : axis.lag_s) {
      const double share = 1.0 - std::exp(-dt_s / lag_s);
      for (const double limit : axis.limit_rad_s) {
        *response += share * (std::clamp(asked, -limit, limit) - *response);
        ++response;
      }
    }
    for (const double lag_s : axis.free_lag_s) {
      *response += (1.0 - std::exp(-dt_s / lag_s)) * (asked - *response);
      ++response;
    }
    for (const double lag_s : axis.bounded_lag_s) {
      const double share = 1.0 - std::exp(-dt_s / lag_s);
      for (const double bound : axis.acceleration_rad_s2) {
        *response += std::clamp(share * (asked - *response), -bound * dt_s, bound * dt_s);
        ++response;
      }
    }
  }
}

void RateLimits::observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept {
  const double weight = 1.0 - std::exp(-seconds(dt) / seconds(kMemory));
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    Axis& axis = axes_[a];
    const double measured = w_WB_B[static_cast<Eigen::Index>(a)];
    for (std::size_t i = 0; i < kModels; ++i) {
      const double error = measured - axis.response_rad_s[i];
      axis.mean_square[i] += weight * (error * error - axis.mean_square[i]);
    }
    see_plateaus(measured, seconds(dt), &axis);
    decide(&axis);
  }
}

void RateLimits::interrupt(const Eigen::Vector3d& w_WB_B) noexcept {
  for (std::size_t a = 0; a < axes_.size(); ++a) axes_[a].response_rad_s.fill(w_WB_B[static_cast<Eigen::Index>(a)]);
}

void RateLimits::see_plateaus(double measured_rad_s, double dt_s, Axis* axis) noexcept {
  const double* const slowest = axis->response_rad_s.data() + (kLags - 1) * kLimits;
  for (std::size_t l = 0; l + 1 < kLimits; ++l) {
    if (std::abs(slowest[l]) < kOnPlateau * axis->limit_rad_s[l] || slowest[l] * axis->asked_rad_s < 0.0 ||
        std::abs(axis->asked_rad_s) < axis->limit_rad_s[l + 1])
      continue;
    axis->plateau_s[l] = std::min(axis->plateau_s[l] + dt_s, seconds(kMemory));
    const double rate_rad_s = std::copysign(1.0, slowest[l]) * measured_rad_s;
    axis->plateau_rad_s[l] += dt_s / axis->plateau_s[l] * (rate_rad_s - axis->plateau_rad_s[l]);
  }
}

void RateLimits::decide(Axis* axis) noexcept {
  const auto limited_end = axis->mean_square.begin() + kLags * kLimits;
  const auto limited = std::min_element(axis->mean_square.begin(), limited_end);
  const double other = *std::min_element(limited_end, axis->mean_square.end());
  constexpr double kGain = kLeastGain_rad_s * kLeastGain_rad_s;
  const auto at = static_cast<std::size_t>(std::distance(axis->mean_square.begin(), limited));
  const std::size_t l = at % kLimits;
  if (l + 1 < kLimits && other - *limited > kGain && *limited < kLeftOver * other) {
    const double lower = axis->limit_rad_s[std::max<std::size_t>(l, 1) - 1];
    axis->found_rad_s = axis->plateau_s[l] > 0.0 ? std::clamp(axis->plateau_rad_s[l], lower, axis->limit_rad_s[l + 1])
                                                 : axis->limit_rad_s[l];
  } else if (axis->found_rad_s > 0.0) {
    // The best of those with about the limit that was found.
    const auto above = static_cast<std::size_t>(
        std::upper_bound(axis->limit_rad_s.begin(), axis->limit_rad_s.end(), axis->found_rad_s) -
        axis->limit_rad_s.begin());
    double still = std::numeric_limits<double>::infinity();
    for (std::size_t lag = 0; lag < kLags; ++lag)
      for (const std::size_t near : {std::max<std::size_t>(above, 1) - 1, std::min<std::size_t>(above, kLimits - 1)})
        still = std::min(still, axis->mean_square[lag * kLimits + near]);
    if (still - other > kGain && other < kLeftOver * still) axis->found_rad_s = 0.0;
  }
}

Eigen::Vector3d RateLimits::limit_rad_s() const noexcept {
  return {axes_[0].found_rad_s, axes_[1].found_rad_s, axes_[2].found_rad_s};
}

RateCommand RateLimits::limited(const RateCommand& command) const noexcept {
  RateCommand taken = command;
  for (std::size_t a = 0; a < axes_.size(); ++a) {
    double& rate = taken[static_cast<Eigen::Index>(a) + 1];
    if (const double limit = axes_[a].found_rad_s; limit > 0.0) rate = std::clamp(rate, -limit, limit);
  }
  return taken;
}

bool RateLimits::unlike_told() const noexcept {
  return std::any_of(axes_.begin(), axes_.end(), [](const Axis& axis) {
    return axis.found_rad_s > 0.0 && axis.found_rad_s < kUnlike * axis.asked_at_most_rad_s;
  });
}

}  // namespace gatefield::pilot
