#include "client/simulator/estimator.h"

namespace gatefield::simulator {

Estimator::Estimator(const config::StateNoise& noise, std::uint64_t seed) noexcept
    : noise_(noise), random_(seed, Stream("gatefield.state_noise")) {}

QuadrotorState Estimator::estimate(const QuadrotorState& truth) noexcept {
  QuadrotorState state = truth;
  state.p_WB += error(noise_.position_m);
  state.v_WB += error(noise_.velocity_m_s);
  const Eigen::Vector3d turn_B = error(noise_.attitude_rad);
  if (turn_B.norm() > 0) state.q_WB = (state.q_WB * Eigen::AngleAxisd(turn_B.norm(), turn_B.normalized())).normalized();
  state.w_WB_B += error(noise_.rate_rad_s);
  return state;
}

Eigen::Vector3d Estimator::error(double sigma) noexcept {
  if (sigma == 0.0) return Eigen::Vector3d::Zero();
  const double x = random_.normal(), y = random_.normal(), z = random_.normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

}  // namespace gatefield::simulator
