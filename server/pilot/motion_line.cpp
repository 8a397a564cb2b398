#include "server/pilot/motion_line.h"

#include <algorithm>

namespace gatefield::pilot {

const char* MotionLine::unexplained(const Point& from, const Point& to, bool free) noexcept {
  const Stamp dt = to.stamp - from.stamp;
  const Stamp passed = free ? Stamp{0} : std::max(to.received - from.received, Stamp{0});
  const double dt_s = seconds(dt), room_s = seconds(std::min(dt, passed + kLongest));

  const Eigen::Vector3d moved_m = 0.5 * dt_s * (from.v_WB + to.v_WB);
  const double speed_m_s = std::max(from.v_WB.norm(), to.v_WB.norm());
  if ((to.p_WB - from.p_WB - moved_m).norm() > kPosition_m + room_s * (2.0 * speed_m_s + kSlip_m_s)) return "p_WB";

  if ((to.v_WB - from.v_WB).norm() > kVelocity_m_s + room_s * kAcceleration_m_s2) return "v_WB";

  const Eigen::Vector3d turned_B = 0.5 * dt_s * (from.w_WB_B + to.w_WB_B);
  const double angle_rad = turned_B.norm();
  Eigen::Quaterniond q_WB = from.q_WB;
  if (angle_rad > 0.0) q_WB = q_WB * Eigen::AngleAxisd(angle_rad, turned_B / angle_rad);
  const double turn_rad_s = std::max(from.w_WB_B.norm(), to.w_WB_B.norm());
  if (q_WB.angularDistance(to.q_WB) > kAngle_rad + room_s * (2.0 * turn_rad_s + kTurn_rad_s)) return "q_WB";
  return nullptr;
}

MotionLine::Judgement MotionLine::judge(Stamp stamp, Stamp received, const QuadrotorState& state, bool free) noexcept {
  const Point here{stamp, received, state.p_WB, state.v_WB, state.w_WB_B, state.q_WB.normalized()};
  const char* const field = state_.begun ? unexplained(state_.newest, here, free) : nullptr;
  if (!field) {
    state_.begun = true;
    state_.newest = here;
    state_.agreeing = 0;
    return {};
  }
  // A lockstep client sends the same state again until it is answered: it is no second witness.
  if (state_.agreeing > 0 && stamp == state_.elsewhere.stamp) return {Verdict::kOff, field};
  const bool agrees =
      state_.agreeing > 0 && stamp > state_.elsewhere.stamp && !unexplained(state_.elsewhere, here, free);
  state_.agreeing = agrees ? state_.agreeing + 1 : 1;
  state_.elsewhere = here;
  if (state_.agreeing < kAgree) return {Verdict::kOff, field};
  state_.newest = here;
  state_.agreeing = 0;
  ++state_.jumps;
  return {Verdict::kNewLine, field};
}

}  // namespace gatefield::pilot
