#include "client/flight/frames.h"

#include <cmath>
#include <numbers>

namespace gatefield::flight {
namespace {

constexpr double kPi = std::numbers::pi;

/// The half turn about (1, 1, 0), and the one about x; both are their own inverse but for the sign, which is settled by
/// `upper_half`.
Eigen::Quaterniond world_turn() noexcept { return {0.0, std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2, 0.0}; }
Eigen::Quaterniond body_turn() noexcept { return {0.0, 1.0, 0.0, 0.0}; }

Eigen::Quaterniond upper_half(const Eigen::Quaterniond& q) noexcept {
  return q.w() < 0.0 ? Eigen::Quaterniond(-q.w(), -q.x(), -q.y(), -q.z()) : q;
}

Eigen::Quaterniond change_axes(const Eigen::Quaterniond& q) noexcept {
  return upper_half(world_turn() * q * body_turn());
}

double change_heading(double yaw_rad) noexcept {
  const double turned = std::remainder(kPi / 2 - yaw_rad, 2 * kPi);
  return turned <= -kPi ? kPi : turned;
}

}  // namespace

Eigen::Vector3d ned_from_enu(const Eigen::Vector3d& v_W) noexcept { return {v_W.y(), v_W.x(), -v_W.z()}; }
Eigen::Vector3d enu_from_ned(const Eigen::Vector3d& v_N) noexcept { return {v_N.y(), v_N.x(), -v_N.z()}; }

Eigen::Vector3d frd_from_flu(const Eigen::Vector3d& v_B) noexcept { return {v_B.x(), -v_B.y(), -v_B.z()}; }
Eigen::Vector3d flu_from_frd(const Eigen::Vector3d& v_F) noexcept { return {v_F.x(), -v_F.y(), -v_F.z()}; }

Eigen::Quaterniond ned_frd_from_enu_flu(const Eigen::Quaterniond& q_WB) noexcept { return change_axes(q_WB); }
Eigen::Quaterniond enu_flu_from_ned_frd(const Eigen::Quaterniond& q_NF) noexcept { return change_axes(q_NF); }

double ned_yaw_from_enu(double yaw_W_rad) noexcept { return change_heading(yaw_W_rad); }
double enu_yaw_from_ned(double yaw_N_rad) noexcept { return change_heading(yaw_N_rad); }

std::array<double, 4> wxyz(const Eigen::Quaterniond& q) noexcept { return {q.w(), q.x(), q.y(), q.z()}; }
std::array<double, 4> xyzw(const Eigen::Quaterniond& q) noexcept { return {q.x(), q.y(), q.z(), q.w()}; }
Eigen::Quaterniond from_wxyz(const std::array<double, 4>& values) noexcept {
  return {values[0], values[1], values[2], values[3]};
}
Eigen::Quaterniond from_xyzw(const std::array<double, 4>& values) noexcept {
  return {values[3], values[0], values[1], values[2]};
}

}  // namespace gatefield::flight
