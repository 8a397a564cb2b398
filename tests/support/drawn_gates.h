#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/gate.h"

namespace gatefield::test {

/// A depth image of gates over a floor at z = 0, without a renderer: each pixel's ray meets the gates' planes and the
/// floor. 0 = nothing in range.
inline std::vector<float> draw_gates(const CameraModel& camera, const Eigen::Isometry3d& X_WC,
                                     const std::vector<Eigen::Isometry3d>& gates, const GateShape& shape) {
  std::vector<float> depth_m;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Eigen::Vector3d ray_W = X_WC.linear() * camera.ray_C(u, v);
      double nearest = camera.max_depth_m;
      if (ray_W.z() < 0) nearest = std::min(nearest, -X_WC.translation().z() / ray_W.z());
      for (const Eigen::Isometry3d& X_WG : gates) {
        const Eigen::Vector3d p_G = X_WG.inverse() * X_WC.translation(), ray_G = X_WG.linear().transpose() * ray_W;
        const double t = -p_G.x() / ray_G.x();
        const double r = transverse_distance(shape, p_G + t * ray_G);
        if (t > 0 && t < nearest && r >= shape.inner_half_m && r <= shape.outer_half_m) nearest = t;
      }
      depth_m.push_back(nearest < camera.max_depth_m ? static_cast<float>(nearest) : 0.0f);
    }
  }
  return depth_m;
}

}  // namespace gatefield::test
