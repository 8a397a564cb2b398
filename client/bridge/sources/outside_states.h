#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <optional>

#include "client/bridge/sources/admission.h"
#include "client/bridge/sources/motion_filter.h"
#include "client/bridge/sources/options.h"
#include "client/flight/ports.h"
#include "common/base/mailbox.h"
#include "common/protocol/ros.h"

namespace gatefield::bridge::sources {

/// Makes states of poses or odometry: world ENU, body FLU, stamps of the loop's clock. Position, attitude, velocity and
/// body rates all come from the one message, so that they belong to one moment; the flight controller's attitude comes
/// without a stamp and with a heading of its own, and is held against them instead (flight::Check::kAttitudesAgree).
///
///   q_WB = R_z(yaw_WO) q_OM q_MB      p_WB = p_WO + R_z(yaw_WO) (p_OM + q_OM p_MB)
///   w_B = q_MB^-1 w_M                 v_WB = R_z(yaw_WO) q_OM (v_M + w_M x p_MB)
///
/// with v_M and w_M the twist of nav_msgs/Odometry, in the axes of M. Of poses MotionFilter makes the two.
/// Thread-safe: messages come on one thread at a time, newest() is called on another.   Real-time safe: yes but for
/// refusals.   Errors: none; what gives no state is counted (admission()).
class OutsideStates final : public flight::StateSource {
 public:
  /// @pre validate(options)
  explicit OutsideStates(const StateOptions& options);

  /// @pre ros::validate(message), and its quaternion is normalised
  void on_odometry(const Moment& moment, const ros::Odometry& odometry, std::uint64_t program);
  void on_pose(const Moment& moment, const ros::PoseStamped& pose, std::uint64_t program);
  void on_rejected(const Error& why) { admission_.refuse(Refusal::kMalformed, why); }

  std::optional<flight::TimedState> newest(Stamp now) noexcept override;

  const Admission& admission() const noexcept { return admission_; }
  /// How far the velocity lags behind the position; 0 for odometry, whose affair it is.
  Stamp velocity_lag() const noexcept { return Stamp(lag_ns_); }

 private:
  bool in_frame(const ros::Header& header);

  const StateOptions options_;
  const Eigen::Quaterniond q_WO_, q_MB_;
  Admission admission_;
  MotionFilter filter_;
  std::atomic<std::int64_t> lag_ns_{0};
  Mailbox<flight::TimedState> mailbox_;
  std::optional<flight::TimedState> newest_;  // the loop's
};

}  // namespace gatefield::bridge::sources
