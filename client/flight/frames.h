#pragma once

#include <Eigen/Geometry>
#include <array>

/// The one place that knows both conventions of axes. Gatefield's own: world W is ENU (x east, y north, z up), body B
/// is FLU (x forward, y left, z up). That of flight controllers and of aviation: world N is NED (north, east, down),
/// body F is FRD (forward, right, down). Origins are the same: N and W share theirs, F and B the centre of mass.
///
/// Both changes of axes are half turns, R_NW about (1, 1, 0) and R_FB about x, so that each is its own inverse:
///   world vectors  v_N = R_NW v_W = (v_y, v_x, -v_z)          positions, velocities, accelerations, forces
///   body vectors   v_F = R_FB v_B = (v_x, -v_y, -v_z)         body rates, specific forces, torques, lever arms
///   attitudes      q_NF = q_NW q_WB q_BF
/// All are exact in floating point but for attitudes, which round.
/// Thread-safe: yes (pure).   Real-time safe: yes.   Errors: none.
namespace gatefield::flight {

/// World axes.
Eigen::Vector3d ned_from_enu(const Eigen::Vector3d& v_W) noexcept;
Eigen::Vector3d enu_from_ned(const Eigen::Vector3d& v_N) noexcept;

/// Body axes.
Eigen::Vector3d frd_from_flu(const Eigen::Vector3d& v_B) noexcept;
Eigen::Vector3d flu_from_frd(const Eigen::Vector3d& v_F) noexcept;

/// Attitude, body to world: R(q_NF) = R_NW R(q_WB) R_BF. Of the two quaternions of an attitude the one with w >= 0.
/// @pre unit length
Eigen::Quaterniond ned_frd_from_enu_flu(const Eigen::Quaterniond& q_WB) noexcept;
Eigen::Quaterniond enu_flu_from_ned_frd(const Eigen::Quaterniond& q_NF) noexcept;

/// Heading: counter-clockwise from east against clockwise from north, rad; the result is in (-pi, pi]. Its own inverse.
double ned_yaw_from_enu(double yaw_W_rad) noexcept;
double enu_yaw_from_ned(double yaw_N_rad) noexcept;

/// Quaternions as numbers in a row. w first: PX4, MAVLink, Betaflight, MuJoCo. w last: Gatefield's wire, ROS, Eigen's
/// coeffs(). The readers take them as they are; who calls checks the length.
std::array<double, 4> wxyz(const Eigen::Quaterniond& q) noexcept;
std::array<double, 4> xyzw(const Eigen::Quaterniond& q) noexcept;
Eigen::Quaterniond from_wxyz(const std::array<double, 4>& values) noexcept;
Eigen::Quaterniond from_xyzw(const std::array<double, 4>& values) noexcept;

}  // namespace gatefield::flight
