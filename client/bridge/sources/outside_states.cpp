#include "client/bridge/sources/outside_states.h"

#include "common/base/text.h"

namespace gatefield::bridge::sources {
namespace {

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

flight::TimedState timed(Stamp stamp) {
  flight::TimedState made;
  made.stamp = stamp;
  made.thrust_known = false;
  return made;
}

}  // namespace

OutsideStates::OutsideStates(const StateOptions& options)
    : options_(options),
      q_WO_(about(Eigen::Vector3d::UnitZ(), options.yaw_WO_rad)),
      q_MB_(about(Eigen::Vector3d::UnitZ(), options.rpy_MB_rad.z()) *
            about(Eigen::Vector3d::UnitY(), options.rpy_MB_rad.y()) *
            about(Eigen::Vector3d::UnitX(), options.rpy_MB_rad.x())),
      admission_(options.time),
      filter_(options.velocity_window) {}

bool OutsideStates::in_frame(const ros::Header& header) {
  if (options_.frame_id.empty() || header.frame_id == options_.frame_id) return true;
  admission_.refuse(Refusal::kFrame,
                    Error::invalid("header.frame_id", "'" + shown(header.frame_id, 64) + "'",
                                   "'" + options_.frame_id + "', as states.frame_id of the configuration says"));
  return false;
}

void OutsideStates::on_odometry(const Moment& moment, const ros::Odometry& odometry, std::uint64_t program) {
  if (!in_frame(odometry.pose.header)) return;
  const auto stamp = admission_.admit(moment, odometry.pose.header.stamp, program);
  if (!stamp) return;
  const Eigen::Quaterniond q_WM = q_WO_ * odometry.pose.orientation;
  flight::TimedState made = timed(*stamp);
  made.state.q_WB = (q_WM * q_MB_).normalized();
  made.state.p_WB = options_.p_WO + q_WO_ * odometry.pose.position + q_WM * options_.p_MB;
  made.state.v_WB = q_WM * (odometry.linear + odometry.angular.cross(options_.p_MB));
  made.state.w_WB_B = q_MB_.conjugate() * odometry.angular;
  mailbox_.write(made);
}

void OutsideStates::on_pose(const Moment& moment, const ros::PoseStamped& pose, std::uint64_t program) {
  if (!in_frame(pose.header)) return;
  const auto stamp = admission_.admit(moment, pose.header.stamp, program);
  if (!stamp) return;
  const Eigen::Quaterniond q_WM = q_WO_ * pose.orientation, q_WB = (q_WM * q_MB_).normalized();
  const Eigen::Vector3d p_WB = options_.p_WO + q_WO_ * pose.position + q_WM * options_.p_MB;
  const auto motion = filter_.take(*stamp, p_WB, q_WB);
  if (!motion) return;
  lag_ns_ = motion->lag.count();
  flight::TimedState made = timed(*stamp);
  made.state.q_WB = q_WB;
  made.state.p_WB = p_WB;
  made.state.v_WB = motion->v_W;
  made.state.w_WB_B = motion->w_B;
  mailbox_.write(made);
}

std::optional<flight::TimedState> OutsideStates::newest(Stamp) noexcept {
  if (const flight::TimedState* fresh = mailbox_.read()) newest_ = *fresh;
  return newest_;
}

}  // namespace gatefield::bridge::sources
