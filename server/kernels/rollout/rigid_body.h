#pragma once

#include "common/vehicle/quadrotor.h"

namespace gatefield::kernels {

/// What moves the body from its rates and its thrust, whatever made them: steps (3) to (5) of gatefield::step_planner
/// with every product of constants taken, in single precision. The limits are those of rollout.h.
struct RigidBodyConstants {
  float half_dt, quarter_dt;
  float dt_over_mass;  ///< change of speed per newton
  float drag[3], gravity_dt;
  float position_limit, speed_limit, rate_limit;
};

/// @param thrust_factor  real thrust over the one that the rollouts carry
RigidBodyConstants rigid_body_constants(const QuadrotorModel& model, double dt_s, double thrust_factor = 1.0) noexcept;

inline constexpr int kBodyRows = 13;
/// p, v, q(wxyz), w: what a tile's rows begin with. @param rows  [kBodyRows], written
void lay_out_body(const QuadrotorState& state, float* rows) noexcept;

}  // namespace gatefield::kernels
