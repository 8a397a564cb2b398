#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/base/result.h"

namespace gatefield {

/// A racing gate: a flat frame around an opening. Frame G: x through the opening (the passing direction), y left, z up.
struct GateShape {
  enum class Opening { kSquare, kRound };
  Opening opening = Opening::kSquare;
  double inner_half_m = 0.5;   ///< half-width c of the opening (radius when round)
  double outer_half_m = 0.75;  ///< half-width of the frame's outer edge
  double thickness_m = 0.06;   ///< extent of the frame along x
};

/// The cone angle alpha of the hourglass. The paper leaves its value open; 20 deg is what the models here are trained
/// with.
inline constexpr double kGuideConeAngle_rad = 0.3490658503988659;

/// Transverse distance r(p) from the gate's axis: l-infinity for square openings, l2 for round ones (paper, Eq. 1).
inline double transverse_distance(const GateShape& shape, const Eigen::Vector3d& p_G) noexcept {
  if (shape.opening == GateShape::Opening::kRound) return std::hypot(p_G.y(), p_G.z());
  return std::max(std::abs(p_G.y()), std::abs(p_G.z()));
}

/// Gate-SDF s_guide(p) = c + |x| tan(alpha) - r(p), metres, positive inside the hourglass (paper, Eq. 2).
inline double guide_sdf(const GateShape& shape, const Eigen::Vector3d& p_G,
                        double cone_angle_rad = kGuideConeAngle_rad) noexcept {
  return shape.inner_half_m + std::abs(p_G.x()) * std::tan(cone_angle_rad) - transverse_distance(shape, p_G);
}

/// Says which field is wrong and why: 0.1 <= inner < outer <= 5 m, 0.005 <= thickness <= 1 m.
Status validate(const GateShape& shape);

}  // namespace gatefield
