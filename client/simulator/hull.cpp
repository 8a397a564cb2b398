#include "client/simulator/hull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace gatefield::simulator {
namespace {

constexpr int kSections = 36;  ///< pi * 0.618^36 = 1e-7 rad

/// How far p lies outside of the box |x_i| <= half_i, with its direction.
Eigen::Vector3d outside(const Eigen::Vector3d& p, const Eigen::Vector3d& half_m) noexcept {
  return p - p.cwiseMax(-half_m).cwiseMin(half_m);
}

/// Least squared distance between the box |x_i| <= half_i and the points p + t d, |t| <= length. Half of its derivative
/// along t, g(t) = d . outside(p + t d), rises, and is linear between the six places where a coordinate meets a face:
/// those narrow the bracket of its root until it is linear there.
double chord_distance_squared(const Eigen::Vector3d& p, const Eigen::Vector3d& d, double length,
                              const Eigen::Vector3d& half_m) noexcept {
  const auto slope = [&](double t) { return d.dot(outside(p + t * d, half_m)); };
  const auto value = [&](double t) { return outside(p + t * d, half_m).squaredNorm(); };
  double low = -length, high = length;
  double g_low = slope(low), g_high = slope(high);
  if (g_low >= 0.0) return value(low);
  if (g_high <= 0.0) return value(high);
  for (int i = 0; i < 3; ++i)
    for (const double face_m : {-half_m[i], half_m[i]}) {
      const double t = (face_m - p[i]) / d[i];  // infinite or NaN along the face: not in the bracket
      if (!(t > low && t < high)) continue;
      const double g = slope(t);
      if (g <= 0.0) {
        low = t;
        g_low = g;
      } else {
        high = t;
        g_high = g;
      }
    }
  return value(low + (high - low) * (-g_low / (g_high - g_low)));
}

}  // namespace

double distance(const Eigen::Vector3d& p_W, const scene::Box& box) noexcept {
  const Eigen::Vector3d p_O = box.X_WO.inverse() * p_W;
  return (p_O.cwiseAbs() - box.half_m).cwiseMax(0.0).norm();
}

double distance(const Disc& disc_W, const scene::Box& box) noexcept {
  const Eigen::Vector3d center_O = box.X_WO.inverse() * disc_W.center_m;
  const Eigen::Vector3d normal_O = box.X_WO.linear().transpose() * disc_W.normal;
  const Eigen::Vector3d across = normal_O.unitOrthogonal(), along = normal_O.cross(across);
  // By the angle and not by the place across the disc: there the chords' ends would run away at the rim.
  const auto of_chord = [&](double angle) {
    return chord_distance_squared(center_O + disc_W.radius_m * std::sin(angle) * across, along,
                                  disc_W.radius_m * std::cos(angle), box.half_m);
  };
  constexpr double kGolden = 1.0 / std::numbers::phi;
  double low = -0.5 * std::numbers::pi, high = -low;
  double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
  double f_left = of_chord(left), f_right = of_chord(right);
  for (int i = 0; i < kSections && std::min(f_left, f_right) > 0.0; ++i) {
    if (f_left < f_right) {
      high = right;
      right = left;
      f_right = f_left;
      left = high - kGolden * (high - low);
      f_left = of_chord(left);
    } else {
      low = left;
      left = right;
      f_left = f_right;
      right = low + kGolden * (high - low);
      f_right = of_chord(right);
    }
  }
  return std::sqrt(std::min(f_left, f_right)) - kHullError_m;
}

double Hull::reach_m() const noexcept {
  double reach_m = body_radius_m;
  for (std::size_t i = 0; i < disc_count; ++i)
    reach_m = std::max(reach_m, discs_B[i].center_m.norm() + discs_B[i].radius_m);
  return reach_m;
}

Hull hull_of(const config::Vehicle& vehicle, config::HullKind kind) {
  Hull hull;
  hull.body_radius_m = vehicle.quadrotor.collision_radius_m;
  if (kind == config::HullKind::kSphere) return hull;
  for (const PlainVector2& rotor_B : vehicle.quadrotor.rotor_position_B_m)
    hull.discs_B[hull.disc_count++] = {
        {rotor_B.x(), rotor_B.y(), 0.0}, Eigen::Vector3d::UnitZ(), vehicle.propeller_radius_m};
  return hull;
}

PlacedHull::PlacedHull(const Hull& hull, const Eigen::Vector3d& p_WB, const Eigen::Quaterniond& q_WB) noexcept
    : hull_(hull), p_WB_(p_WB) {
  const Eigen::Matrix3d R_WB = q_WB.normalized().toRotationMatrix();
  for (std::size_t i = 0; i < hull.disc_count; ++i)
    discs_W_[i] = {p_WB + R_WB * hull.discs_B[i].center_m, R_WB * hull.discs_B[i].normal, hull.discs_B[i].radius_m};
}

double PlacedHull::nearest_m(const scene::Box& box, double limit_m) const noexcept {
  double nearest_m = std::min(limit_m, distance(p_WB_, box) - hull_.body_radius_m);
  for (std::size_t i = 0; i < hull_.disc_count; ++i) {
    const Disc& disc_W = discs_W_[i];
    if (distance(disc_W.center_m, box) - disc_W.radius_m < nearest_m)
      nearest_m = std::min(nearest_m, distance(disc_W, box));
  }
  return nearest_m;
}

double PlacedHull::discs_above_m(double floor_z_m) const noexcept {
  double lowest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull_.disc_count; ++i) {
    const Disc& disc_W = discs_W_[i];
    lowest_m =
        std::min(lowest_m, disc_W.center_m.z() - disc_W.radius_m * std::hypot(disc_W.normal.x(), disc_W.normal.y()));
  }
  return lowest_m - floor_z_m;
}

}  // namespace gatefield::simulator
