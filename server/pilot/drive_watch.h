#pragma once

#include <Eigen/Core>

#include "common/base/clock.h"
#include "common/protocol/identified_drive.h"
#include "common/protocol/problems.h"
#include "server/pilot/rate_lags.h"
#include "server/pilot/rate_limits.h"
#include "server/pilot/thrust_factor.h"

namespace gatefield::pilot {

/// How a vehicle of body rates follows what it is asked for, identified from its flight: lags and limits of its rates
/// (RateLags, RateLimits), and beside them what ThrustFactor found. The lags are held against what the vehicle takes of
/// its command: clamped where a limit was found, so that a plateau does not look like a slow loop.
/// Thread-safe: no (control step).   Real-time safe: yes.
class DriveWatch {
 public:
  /// @pre validate(told).ok() and told.kind is kBodyRates
  /// @param asked_at_most_rad_s  what is ever asked for, about each axis of B; more than 0
  DriveWatch(const Actuation& told, const Eigen::Vector3d& asked_at_most_rad_s) noexcept
      : lags_(told), limits_(told, asked_at_most_rad_s) {}

  /// What was asked for during the next dt.
  void follow(const RateCommand& asked, Stamp dt) noexcept;
  /// What the rates came to at the end of what was followed. @param dt  since the last observation
  void observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept;
  /// What was asked for is not known for a while.
  void interrupt(const Eigen::Vector3d& w_WB_B) noexcept;

  /// What is unlike what was told.
  protocol::Problems problems(const ThrustFactor& thrust) const noexcept;
  /// What is known now goes into `found`. What is not known any more stays as it was found last: an axis that hardly
  /// moves keeps its lag.
  void fill(const ThrustFactor& thrust, protocol::IdentifiedDrive* found) const noexcept;

 private:
  RateLags lags_;
  RateLimits limits_;
};

}  // namespace gatefield::pilot
