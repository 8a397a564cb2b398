#include "server/planner/costs/guidance.h"

#include <Eigen/Geometry>

namespace gatefield::planner {

Guidance make_guidance(const Eigen::Vector3d& center_W, const Eigen::Vector3d& axis_W, bool funnel,
                       double half_angle_rad, double distance_m, double outer_half_m, double side) noexcept {
  constexpr double kBesideGap_m = 0.7;  // beside the frame: room for the vehicle and for its overshoot
  Eigen::Vector3d beside = axis_W.cross(Eigen::Vector3d::UnitZ());
  beside = beside.norm() > 1e-3 ? beside.normalized() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3f c = center_W.cast<float>();
  const Eigen::Vector3f a = axis_W.cast<float>();
  const Eigen::Vector3f f = (center_W - distance_m * axis_W).cast<float>();
  const Eigen::Vector3f b = (center_W + side * (outer_half_m + kBesideGap_m) * beside).cast<float>();
  Guidance guidance;
  guidance.cx = c.x(), guidance.cy = c.y(), guidance.cz = c.z();
  guidance.ax = a.x(), guidance.ay = a.y(), guidance.az = a.z();
  guidance.fx = f.x(), guidance.fy = f.y(), guidance.fz = f.z();
  guidance.bx = b.x(), guidance.by = b.y(), guidance.bz = b.z();
  guidance.distance_m = static_cast<float>(distance_m);
  guidance.detour_m = (b - f).norm() + guidance.distance_m;
  guidance.cone_slope = static_cast<float>(std::tan(half_angle_rad));
  guidance.funnel = funnel;
  return guidance;
}

}  // namespace gatefield::planner
