#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace gatefield::planner {

/// A potential V(p), metres, that falls along the way to and through a gate's opening. With c the centre, a the passing
/// axis, D the funnel's distance, f = c - D a the point in front of the gate and b a point beside the frame:
///   inside the cone around -a   V = |p - c|
///   outside it                  V = |p - f| + D            first to the point in front
///   beyond the plane            V = |p - b| + |b - f| + D  the way back leads around the frame
/// (Arriving from the side clips a post, hence the point in front.)
/// Without a funnel V = |p - c| everywhere (the paper's waypoint).
struct Guidance {
  float cx = 0, cy = 0, cz = 0;  ///< c
  float ax = 1, ay = 0, az = 0;  ///< a, unit
  float fx = 0, fy = 0, fz = 0;  ///< f
  float bx = 0, by = 0, bz = 0;  ///< b
  float distance_m = 0;          ///< D
  float detour_m = 0;            ///< |b - f| + D
  float cone_slope = 1;          ///< tan of the cone's half angle
  /// From here on a point counts as beyond the plane: a little later, so that the crossing itself sees no step.
  float beyond_m = 0.3f;
  bool funnel = false;

  float along(float x, float y, float z) const noexcept { return (x - cx) * ax + (y - cy) * ay + (z - cz) * az; }

  float potential(float x, float y, float z) const noexcept {
    const float dx = x - cx, dy = y - cy, dz = z - cz;
    const float squared = dx * dx + dy * dy + dz * dz;
    const float direct = std::sqrt(squared);
    const float x_axis = dx * ax + dy * ay + dz * az;
    const float lateral = std::sqrt(std::max(0.0f, squared - x_axis * x_axis));
    const float to_front = std::sqrt((x - fx) * (x - fx) + (y - fy) * (y - fy) + (z - fz) * (z - fz)) + distance_m;
    const float around = std::sqrt((x - bx) * (x - bx) + (y - by) * (y - by) + (z - bz) * (z - bz)) + detour_m;
    const float outside = x_axis > beyond_m ? around : to_front;
    return !funnel || lateral <= -x_axis * cone_slope ? direct : outside;
  }
};

/// Makes the potential of a gate. `side` (+1 or -1) chooses on which side the detour leads around.
Guidance make_guidance(const Eigen::Vector3d& center_W, const Eigen::Vector3d& axis_W, bool funnel,
                       double half_angle_rad, double distance_m, double outer_half_m, double side) noexcept;

}  // namespace gatefield::planner
