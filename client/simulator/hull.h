#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "common/config/scenario.h"
#include "common/scene/world.h"

namespace gatefield::simulator {

/// A flat round disc, of no thickness.
struct Disc {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< length 1
  double radius_m = 0.0;
};

/// Most that distance() is below the true distance, for discs of up to 2 m.
inline constexpr double kHullError_m = 1e-6;

/// Distance from a point to a solid box, metres; 0 inside.
double distance(const Eigen::Vector3d& p_W, const scene::Box& box) noexcept;

/// Distance between a disc and a solid box, metres: at most the true one, and at most kHullError_m less. It is negative
/// exactly when they touch, or are nearer than what the search may be off.
///
/// The squared distance of a point to a convex body is convex over the disc, so its minimum over the parallel chords
/// (piecewise quadratic along each, solved exactly) is convex across them: golden section over the chords' angle finds
/// the least to 1e-7 rad times the radius. Thread-safe: yes (pure).   Real-time safe: yes.
double distance(const Disc& disc_W, const scene::Box& box) noexcept;

/// What of a vehicle must not touch anything, in B: a sphere around the centre of mass, the body with its arms,
/// and the discs that the propellers sweep. Rotors lie in the plane of the centre of mass and thrust along +z (as in
/// QuadrotorModel), so every disc has the normal z.
struct Hull {
  double body_radius_m = 0.13;
  std::size_t disc_count = 0;
  std::array<Disc, kRotors> discs_B{};

  /// The farthest that any of it is from the centre of mass.
  double reach_m() const noexcept;
};

Hull hull_of(const config::Vehicle& vehicle, config::HullKind kind);

/// A hull as it stands in the world. Thread-safe: yes (const).   Real-time safe: yes.
class PlacedHull {
 public:
  PlacedHull(const Hull& hull, const Eigen::Vector3d& p_WB, const Eigen::Quaterniond& q_WB) noexcept;

  /// The smaller of `limit_m` and the distance to the box (of the body: negative inside by as much as it is in; of
  /// discs: distance()). What can't be nearer than the limit is not looked at closely.
  double nearest_m(const scene::Box& box, double limit_m) const noexcept;
  /// Height of the lowest point of the discs above a level floor; infinite without discs.
  double discs_above_m(double floor_z_m) const noexcept;
  bool has_discs() const noexcept { return hull_.disc_count > 0; }

 private:
  const Hull& hull_;
  Eigen::Vector3d p_WB_;
  std::array<Disc, kRotors> discs_W_;
};

}  // namespace gatefield::simulator
