#pragma once

#include <Eigen/Core>
#include <span>

namespace gatefield::planner {

/// The Gate-SDF as the planner sees it: signed distance in metres at points in the world frame, wherever it comes from
/// (the network's decoder in the product, an analytic field in unit tests).
/// Thread-safe: evaluate() may run on several threads at once.   Real-time safe: yes.
class Field {
 public:
  virtual ~Field() = default;
  /// sdf[i] = s(x[i], y[i], z[i]); all four spans have the same size.
  virtual void evaluate(std::span<const float> x_W, std::span<const float> y_W, std::span<const float> z_W,
                        std::span<float> sdf_m) const noexcept = 0;
};

/// What is known of the gate at a waypoint. Everything but the nominal waypoint is derived from decoder values.
struct GateBelief {
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< of the opening
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();   ///< unit, in the passing direction
  bool seen = false;                                   ///< false: centre and axis are the nominal waypoint's
  double center_sigma_m = 1.0;                         ///< how sure, one sigma
  double axis_sigma_rad = 1.0;
  const Field* field = nullptr;  ///< null until a valid latent is in the memory
  /// center_W minus the centre that perception believes in: profiles may keep the nominal waypoint all the same. No
  /// plan depends on it; it keeps what was believed apart from what was aimed at.
  Eigen::Vector3d moved_W = Eigen::Vector3d::Zero();
};

}  // namespace gatefield::planner
