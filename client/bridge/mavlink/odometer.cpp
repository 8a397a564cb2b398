#include "client/bridge/mavlink/odometer.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "client/firmware/mavlink/constants.h"
#include "client/flight/frames.h"
#include "common/base/text.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using mavlink::AxesFrame;

bool is_local(std::uint8_t frame) noexcept {
  return frame == static_cast<std::uint8_t>(AxesFrame::kLocalNed) ||
         frame == static_cast<std::uint8_t>(AxesFrame::kLocalFrd);
}
bool is_body(std::uint8_t frame) noexcept { return frame == static_cast<std::uint8_t>(AxesFrame::kBodyFrd); }

Eigen::Vector3d vector(float x, float y, float z) noexcept {
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

Eigen::Quaterniond quaternion(float w, float x, float y, float z) noexcept {
  return Eigen::Quaterniond(static_cast<double>(w), static_cast<double>(x), static_cast<double>(y),
                            static_cast<double>(z))
      .normalized();
}

Eigen::Quaterniond turn_by(const Eigen::Vector3d& angle) noexcept {
  const double size = angle.norm();
  if (size < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(size, angle / size));
}

std::string milliseconds(Stamp span) { return text(seconds(span) * 1e3) + " ms"; }

}  // namespace

Status validate(const OdometerOptions& options) {
  if (!options.frame.p_WL.allFinite() || options.frame.p_WL.cwiseAbs().maxCoeff() > 1e5)
    return Error::invalid("state.p_WL", text(options.frame.p_WL), "-100000 to 100000 m each");
  if (!(std::abs(options.frame.yaw_WL_rad) <= 6.2832))
    return Error::invalid("state.yaw_WL_rad", text(options.frame.yaw_WL_rad) + " rad", "-6.2832 to 6.2832 rad");
  if (options.oldest < 5ms || options.oldest > 1s)
    return Error::invalid("state.oldest", milliseconds(options.oldest), "5 to 1000 ms");
  return {};
}

NoState Odometer::refuse(NoState why) noexcept {
  ++refused_[static_cast<std::size_t>(why)];
  return why;
}

NoState Odometer::take(Stamp now, Stamp stamp, const QuadrotorState& state_L) noexcept {
  const Stamp age = now - stamp;
  if (age < -kFuture || age > options_.oldest) {
    wrong_age_ = age;
    return refuse(age < Stamp{0} ? NoState::kFuture : NoState::kOld);
  }
  if (state_ && stamp <= state_->stamp) return refuse(NoState::kNotRising);
  const Eigen::AngleAxisd turn(options_.frame.yaw_WL_rad, Eigen::Vector3d::UnitZ());
  flight::TimedState timed;
  timed.stamp = stamp;
  timed.thrust_known = false;
  timed.state = state_L;
  timed.state.p_WB = options_.frame.p_WL + turn * state_L.p_WB;
  timed.state.v_WB = turn * state_L.v_WB;
  timed.state.q_WB = Eigen::Quaterniond(turn) * Eigen::Quaterniond(state_L.q_WB);
  state_ = timed;
  attitude_ = timed.state.q_WB;
  age_ = age;
  ++states_;
  return NoState::kNone;
}

NoState Odometer::on_odometry(Stamp now, Stamp stamp, const mavlink::Odometry& message) noexcept {
  if (options_.from == StateFrom::kLocalPosition) return NoState::kNone;
  if (!is_local(message.frame_id) || !(is_local(message.child_frame_id) || is_body(message.child_frame_id)))
    return refuse(NoState::kFrame);
  if (message.quality < 0) return refuse(NoState::kQuality);
  const Eigen::Quaterniond q_NF = quaternion(message.q[0], message.q[1], message.q[2], message.q[3]);
  Eigen::Vector3d v_N = vector(message.vx, message.vy, message.vz);
  if (is_body(message.child_frame_id)) v_N = q_NF * v_N;
  QuadrotorState state_L;
  state_L.p_WB = flight::enu_from_ned(vector(message.x, message.y, message.z));
  state_L.v_WB = flight::enu_from_ned(v_N);
  state_L.q_WB = flight::enu_flu_from_ned_frd(q_NF);
  state_L.w_WB_B = flight::flu_from_frd(vector(message.rollspeed, message.pitchspeed, message.yawspeed));
  const NoState why = take(now, stamp, state_L);
  if (why != NoState::kNone) return why;
  odometry_at_ = now;
  if (reset_counter_ && *reset_counter_ != message.reset_counter) ++jumps_;
  reset_counter_ = message.reset_counter;
  return why;
}

bool Odometer::takes_pairs(Stamp now) const noexcept {
  if (options_.from == StateFrom::kOdometry) return false;
  return options_.from == StateFrom::kLocalPosition || !odometry_at_ || now - *odometry_at_ > kOdometryLost;
}

NoState Odometer::on_position(Stamp now, Stamp stamp, const mavlink::LocalPositionNed& message) noexcept {
  position_ = {stamp, flight::enu_from_ned(vector(message.x, message.y, message.z)),
               flight::enu_from_ned(vector(message.vx, message.vy, message.vz))};
  return pair(now);
}

NoState Odometer::on_attitude(Stamp now, Stamp stamp, const mavlink::AttitudeQuaternion& message) noexcept {
  paired_attitude_ = {stamp, flight::enu_flu_from_ned_frd(quaternion(message.q1, message.q2, message.q3, message.q4)),
                      flight::flu_from_frd(vector(message.rollspeed, message.pitchspeed, message.yawspeed))};
  const Eigen::AngleAxisd turn(options_.frame.yaw_WL_rad, Eigen::Vector3d::UnitZ());
  attitude_ = Eigen::Quaterniond(turn) * paired_attitude_->q_LB;
  return pair(now);
}

NoState Odometer::pair(Stamp now) noexcept {
  if (!takes_pairs(now)) return NoState::kNone;
  if (!position_ || !paired_attitude_) return refuse(NoState::kNotPaired);
  const Stamp gap = paired_attitude_->stamp - position_->stamp;
  if (std::max(gap, -gap) > kPairGap) return refuse(NoState::kNotPaired);
  const double ahead_s = seconds(gap);
  QuadrotorState state_L;
  state_L.p_WB = position_->p_L + position_->v_L * std::max(ahead_s, 0.0);
  state_L.v_WB = position_->v_L;
  state_L.q_WB = paired_attitude_->q_LB * turn_by(paired_attitude_->w_B * std::max(-ahead_s, 0.0));
  state_L.w_WB_B = paired_attitude_->w_B;
  const Stamp stamp = std::max(position_->stamp, paired_attitude_->stamp);
  // Of two messages of one moment the first has given the state, with the other one's predecessor carried forward.
  if (state_ && stamp == state_->stamp) return NoState::kNone;
  return take(now, stamp, state_L);
}

Error describe(NoState why, Stamp wrong_age, const OdometerOptions& options) {
  switch (why) {
    case NoState::kFrame:
      return Error(
          "ODOMETRY comes in axes that are not understood; expected frame_id 1 (local NED) or 20 (local FRD) and "
          "child_frame_id 1, 20 or 12 (body FRD)",
          ErrorCode::kUnsupported, "ODOMETRY.frame_id");
    case NoState::kQuality:
      return Error("the autopilot says that its estimate has failed (ODOMETRY.quality is below 0)", ErrorCode::kInvalid,
                   "ODOMETRY.quality");
    case NoState::kNotPaired:
      return Error(
          "LOCAL_POSITION_NED and ATTITUDE_QUATERNION do not come together; ask the autopilot for both at 50 Hz "
          "or more, or for ODOMETRY",
          ErrorCode::kNoAnswer, "state_from");
    case NoState::kFuture:
    case NoState::kOld:
      return Error::invalid("state.age", milliseconds(wrong_age),
                            milliseconds(-Odometer::kFuture) + " to " + milliseconds(options.oldest) +
                                "; the autopilot's clock does not agree with its TIMESYNC, or the link holds messages "
                                "back");
    default:
      return Error("states do not rise in time", ErrorCode::kNotRising, "state.stamp");
  }
}

}  // namespace gatefield::bridge
