#pragma once

#include <Eigen/Core>

#include "common/geometry/gate.h"
#include "server/gates/field.h"

namespace gatefield::gates {

/// What is known of the gate at a waypoint. Everything but the nominal waypoint is derived from what was seen.
struct GateBelief {
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< of the opening
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();   ///< unit, in the waypoint's passing direction
  bool seen = false;                                   ///< false: centre and axis are the nominal waypoint's
  double center_sigma_m = 1.0;                         ///< how sure, one sigma
  double axis_sigma_rad = 1.0;
  GateShape shape;               ///< nominal, from the course
  const Field* field = nullptr;  ///< null until the gate was seen; valid as long as the snapshot it comes from
};

}  // namespace gatefield::gates
