#include "client/sdk/keep_clear.h"

#include <algorithm>
#include <cmath>

namespace gatefield::sdk {

KeepClear::KeepClear(const Course& course, double margin_m) : margin_m_(margin_m) {
  gates_.reserve(gate_count(course));
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    if (gate_index(course, i) != gates_.size()) continue;  // one gate, another passage
    const Waypoint& waypoint = course.waypoints[i];
    const Eigen::Isometry3d X_WG = gate_pose(waypoint.p_W, passing_direction(course, i));
    const Eigen::Vector2d left_W = X_WG.linear().col(1).head<2>().normalized();  // y is level
    gates_.push_back(
        {X_WG.inverse(), {left_W.y(), -left_W.x()}, left_W, waypoint.gate.inner_half_m, waypoint.gate.outer_half_m});
  }
}

Eigen::Vector2d KeepClear::drift(const Eigen::Vector3d& p_W, bool sinking) const noexcept {
  Eigen::Vector2d strongest = Eigen::Vector2d::Zero();
  for (const Gate& gate : gates_) {
    const Eigen::Vector3d p_G = gate.X_GW * p_W;
    const double reach_m = gate.outer_m + margin_m_;
    const bool beside = std::abs(p_G.y()) > reach_m || p_G.z() < -reach_m || (!sinking && p_G.z() > reach_m);
    const double inside = 1.0 - std::abs(p_G.x()) / (2 * margin_m_);  // 1 at the gate's plane
    if (beside || inside <= 0) continue;
    const Eigen::Vector2d out = std::copysign(kDrift_m_s * inside, p_G.x()) * gate.axis_W;
    if (out.squaredNorm() > strongest.squaredNorm()) strongest = out;
  }
  return strongest;
}

Eigen::Vector2d KeepClear::steer(const Eigen::Vector3d& p_W, const Eigen::Vector3d& v_W) const noexcept {
  Eigen::Vector2d nearest = Eigen::Vector2d::Zero();
  double soonest_s = kAhead_s;
  for (const Gate& gate : gates_) {
    const Eigen::Vector3d p_G = gate.X_GW * p_W;
    const Eigen::Vector3d v_G = gate.X_GW.linear() * v_W;
    const double t_s = -p_G.x() / v_G.x();
    if (!(t_s > 0 && t_s < soonest_s)) continue;
    const Eigen::Vector3d crossing_G = p_G + t_s * v_G;
    const double aside_m = std::abs(crossing_G.y()), up_m = std::abs(crossing_G.z());
    const double hole_m = std::max(gate.inner_m - margin_m_, 0.2 * gate.inner_m);
    const double reach_m = gate.outer_m + margin_m_;
    if (up_m > reach_m || aside_m > reach_m || std::max(aside_m, up_m) < hole_m) continue;
    // Within the height of the opening a way through is a way; above and below it only around.
    const bool through = up_m < gate.inner_m && aside_m < (gate.inner_m + gate.outer_m) / 2;
    const double goal_m = std::copysign(through ? std::min(aside_m, hole_m) : reach_m, crossing_G.y());
    soonest_s = t_s;
    const double across_m_s2 = 2 * (goal_m - crossing_G.y()) / (t_s * t_s);
    nearest = std::clamp(across_m_s2, -kMaxSteer_m_s2, kMaxSteer_m_s2) * gate.left_W;
  }
  return nearest;
}

bool KeepClear::passes(const Eigen::Vector3d& p_W, const Eigen::Vector3d& v_W, double time_s) const noexcept {
  return std::any_of(gates_.begin(), gates_.end(), [&](const Gate& gate) {
    const Eigen::Vector3d p_G = gate.X_GW * p_W;
    const Eigen::Vector3d v_G = gate.X_GW.linear() * v_W;
    const bool here = std::abs(p_G.x()) < margin_m_;
    const double t_s = here ? 0.0 : -p_G.x() / v_G.x();
    if (!(t_s >= 0 && t_s <= time_s)) return false;
    const Eigen::Vector3d crossing_G = p_G + t_s * v_G;
    const double reach_m = gate.outer_m + margin_m_;
    return std::abs(crossing_G.y()) < reach_m && std::abs(crossing_G.z()) < reach_m;
  });
}

}  // namespace gatefield::sdk
