#pragma once

#include <cmath>

#include "common/vehicle/quadrotor.h"
#include "gatefield/sdk/client.h"

namespace gatefield::test {

/// Rates and thrust towards a place, as somebody's outer loop would ask for them.
inline sdk::Setpoint towards(const Eigen::Vector3d& goal, const QuadrotorState& state, const QuadrotorModel& model) {
  const Eigen::Vector3d wanted_W = (2.0 * (goal - state.p_WB) - 2.5 * state.v_WB).cwiseMax(-5.0).cwiseMin(5.0) +
                                   Eigen::Vector3d(0, 0, kGravity_m_s2);
  const Eigen::Quaterniond q(state.q_WB);
  const Eigen::Vector3d up_B = q.inverse() * wanted_W.normalized();
  const Eigen::Vector3d ahead_W = q * Eigen::Vector3d::UnitX();
  sdk::Setpoint setpoint;
  setpoint.body_rates_rad_s = 8.0 * Eigen::Vector3d::UnitZ().cross(up_B);
  setpoint.body_rates_rad_s.z() = 2.0 * (0.8 - std::atan2(ahead_W.y(), ahead_W.x()));  // to a heading of 0.8 rad
  setpoint.collective_thrust_n = model.mass_kg * wanted_W.dot(q * Eigen::Vector3d::UnitZ());
  return setpoint;
}

}  // namespace gatefield::test
