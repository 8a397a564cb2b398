#pragma once

#include <Eigen/Geometry>

#include "server/gates/analytic_field.h"

namespace gatefield::test {

using gates::AnalyticField;

/// A gate's pose from its centre and heading.
inline Eigen::Isometry3d upright_gate(const Eigen::Vector3d& center_W, double yaw_rad) {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.translation() = center_W;
  X_WG.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return X_WG;
}

}  // namespace gatefield::test
