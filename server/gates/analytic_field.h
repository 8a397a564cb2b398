#pragma once

#include <Eigen/Geometry>

#include "common/geometry/gate.h"
#include "server/gates/field.h"

namespace gatefield::gates {

/// The paper's Gate-SDF of a gate whose pose is known: what a perfect network would say. Tests, the baselines of
/// server/baseline and pictures have it; gatefield-server makes none.
/// Thread-safe: yes.   Real-time safe: yes.
class AnalyticField final : public Field {
 public:
  explicit AnalyticField(const Eigen::Isometry3d& X_WG, const GateShape& shape = {},
                         double cone_angle_rad = kGuideConeAngle_rad)
      : X_GW_(X_WG.inverse()), shape_(shape), cone_angle_rad_(cone_angle_rad) {}

  void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                std::span<float> sdf_m) const noexcept override {
    for (std::size_t i = 0; i < x_W.size(); ++i)
      sdf_m[i] =
          static_cast<float>(guide_sdf(shape_, X_GW_ * Eigen::Vector3d(x_W[i], y_W[i], z_W[i]), cone_angle_rad_));
  }

 private:
  Eigen::Isometry3d X_GW_;
  GateShape shape_;
  double cone_angle_rad_;
};

}  // namespace gatefield::gates
