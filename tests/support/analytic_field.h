#pragma once

#include <Eigen/Geometry>

#include "common/geometry/gate.h"
#include "server/planner/field.h"

namespace gatefield::test {

/// The paper's Gate-SDF of a known gate: what a perfect network would say. For tests only; no shipped program has it.
class AnalyticField final : public planner::Field {
 public:
  explicit AnalyticField(const Eigen::Isometry3d& X_WG, const GateShape& shape = {})
      : X_GW_(X_WG.inverse()), shape_(shape) {}

  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override {
    for (std::size_t i = 0; i < x_W.size(); ++i)
      sdf_m[i] = static_cast<float>(guide_sdf(shape_, X_GW_ * Eigen::Vector3d(x_W[i], y_W[i], z_W[i])));
  }

 private:
  Eigen::Isometry3d X_GW_;
  GateShape shape_;
};

/// A gate's pose from its centre and heading.
inline Eigen::Isometry3d upright_gate(const Eigen::Vector3d& center_W, double yaw_rad) {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.translation() = center_W;
  X_WG.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return X_WG;
}

}  // namespace gatefield::test
