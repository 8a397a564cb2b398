#include "server/pilot/drive_watch.h"

namespace gatefield::pilot {

void DriveWatch::follow(const RateCommand& asked, Stamp dt) noexcept {
  limits_.follow(asked, dt);
  lags_.follow(limits_.limited(asked), dt);
}

void DriveWatch::observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept {
  limits_.observe(w_WB_B, dt);
  lags_.observe(w_WB_B, dt);
}

void DriveWatch::interrupt(const Eigen::Vector3d& w_WB_B) noexcept {
  limits_.interrupt(w_WB_B);
  lags_.interrupt(w_WB_B);
}

protocol::Problems DriveWatch::problems(const ThrustFactor& thrust) const noexcept {
  using protocol::bit;
  using protocol::Problem;
  protocol::Problems unlike = 0;
  if (thrust.unlike_told()) unlike |= bit(Problem::kThrustUnlikeTold);
  if (lags_.unlike_told()) unlike |= bit(Problem::kRateLoopUnlikeTold);
  if (limits_.unlike_told()) unlike |= bit(Problem::kRateLimitUnlikeTold);
  return unlike;
}

void DriveWatch::fill(const ThrustFactor& thrust, protocol::IdentifiedDrive* found) const noexcept {
  if (thrust.known()) found->thrust_factor = thrust.value();
  for (int axis = 0; axis < 3; ++axis)
    if (const auto lag_s = lags_.lag_s(axis)) found->rate_time_constant_s[axis] = *lag_s;
  found->rate_limit_rad_s = limits_.limit_rad_s();
}

}  // namespace gatefield::pilot
