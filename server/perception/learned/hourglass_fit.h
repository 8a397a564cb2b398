#pragma once

#include <Eigen/Geometry>

#include "common/geometry/gate.h"
#include "server/gates/field.h"

namespace gatefield::perception {

/// An hourglass fitted to field values.
struct HourglassFit {
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  double rms_m = 0.0;  ///< root mean square of field minus hourglass over the sampled points
  bool ok = false;     ///< false: the values are not finite or no hourglass explains them
};

/// Centre and axis of the opening from field values alone: least squares (Levenberg-Marquardt, Huber weights) of
///   s_guide(X_GW p_i) against field(p_i)
/// over a fixed cloud of points within 2.2 half-openings of `around_W`, starting at several angles about the vertical.
/// The pose makes the field speak about planes and directions; it has no other source. The gate frame's x axis comes
/// out within 90 degrees of `axis_W`; roll about it is only known up to the shape's symmetry.
/// @param cone_angle_rad  of the hourglass that the field was trained with
/// @param around_W        about where the centre is, metres
/// @param axis_W          about the passing direction
/// Thread-safe: yes.   Real-time safe: yes (about 0.3 ms, no allocation).   Errors: HourglassFit::ok.
HourglassFit fit_hourglass(const gates::Field& field, const GateShape& shape, double cone_angle_rad,
                           const Eigen::Vector3d& around_W, const Eigen::Vector3d& axis_W) noexcept;

}  // namespace gatefield::perception
