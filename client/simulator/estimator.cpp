#include "client/simulator/estimator.h"

#include <cmath>

#include "client/simulator/plant.h"

namespace gatefield::simulator {

Estimator::Estimator(const config::StateNoise& noise, const config::EstimateErrors& errors, std::uint64_t seed)
    : noise_(noise),
      errors_(errors),
      wanders_(errors.drift_m_s > 0 || errors.drift_yaw_rad_s > 0 || errors.drift_tilt_rad > 0 || errors.jumps_hz > 0),
      white_(seed, Stream("gatefield.state_noise")),
      drifts_(seed, Stream("gatefield.drift")),
      jumps_(seed, Stream("gatefield.jumps")),
      past_(errors.lag > Stamp{0} ? static_cast<std::size_t>(errors.lag / Plant::kStep) + 2 : 0) {
  velocity_error_ = error(&drifts_, errors_.drift_m_s);
  yaw_rate_ = error(&drifts_, errors_.drift_yaw_rad_s).z();
  tilt_rad_ = error(&drifts_, errors_.drift_tilt_rad).head<2>();
  to_jump_s_ = -std::log1p(-jumps_.uniform());
}

QuadrotorState Estimator::estimate(Stamp now, const QuadrotorState& truth) noexcept {
  QuadrotorState state = past_.empty() ? truth : lagged(now, truth);
  if (wanders_) {
    const double dt_s = last_ ? seconds(now - *last_) : 0.0;
    last_ = now;
    if (dt_s > 0) {
      drift(dt_s, state.v_WB);
      jump(dt_s);
    }
    const Eigen::AngleAxisd turn(yaw_rad_, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d tilt(tilt_rad_.x(), tilt_rad_.y(), 0.0);
    X_EW_ = Eigen::Translation3d(state.p_WB + offset_) * turn * Eigen::Translation3d(-state.p_WB);
    state.p_WB += offset_;
    state.v_WB = turn * state.v_WB + velocity_error_;
    Eigen::Quaterniond q_EB = turn * state.q_WB;
    if (tilt.norm() > 0) q_EB = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * q_EB;
    state.q_WB = q_EB.normalized();
  }
  state.p_WB += error(&white_, noise_.position_m);
  state.v_WB += error(&white_, noise_.velocity_m_s);
  const Eigen::Vector3d turn_B = error(&white_, noise_.attitude_rad);
  if (turn_B.norm() > 0) state.q_WB = (state.q_WB * Eigen::AngleAxisd(turn_B.norm(), turn_B.normalized())).normalized();
  state.w_WB_B += error(&white_, noise_.rate_rad_s);
  return state;
}

/// The newest state that is as old as the lag; before there is one, the oldest.
QuadrotorState Estimator::lagged(Stamp now, const QuadrotorState& truth) noexcept {
  const auto at = [this](std::size_t i) -> Past& { return past_[(begin_ + i) % past_.size()]; };
  if (kept_ == past_.size()) {
    begin_ = (begin_ + 1) % past_.size();
    --kept_;
  }
  at(kept_++) = {now, truth};
  while (kept_ > 1 && at(1).stamp <= now - errors_.lag) {
    begin_ = (begin_ + 1) % past_.size();
    --kept_;
  }
  return at(0).state;
}

void Estimator::drift(double dt_s, const Eigen::Vector3d& v_WB) noexcept {
  const double kept = std::exp(-dt_s / errors_.drift_s), fresh = std::sqrt(1.0 - kept * kept);
  velocity_error_ = kept * velocity_error_ + error(&drifts_, fresh * errors_.drift_m_s);
  yaw_rate_ = kept * yaw_rate_ + error(&drifts_, fresh * errors_.drift_yaw_rad_s).z();
  tilt_rad_ = kept * tilt_rad_ + error(&drifts_, fresh * errors_.drift_tilt_rad).head<2>();
  const Eigen::AngleAxisd turn(yaw_rad_, Eigen::Vector3d::UnitZ());
  offset_ += dt_s * (turn * v_WB - v_WB + velocity_error_);
  yaw_rad_ += dt_s * yaw_rate_;
}

void Estimator::jump(double dt_s) noexcept {
  to_jump_s_ -= dt_s * errors_.jumps_hz;  // in mean waiting times
  while (to_jump_s_ < 0) {
    to_jump_s_ -= std::log1p(-jumps_.uniform());
    offset_ += error(&jumps_, errors_.jump_m);
    yaw_rad_ += error(&jumps_, errors_.jump_yaw_rad).z();
  }
}

Eigen::Vector3d Estimator::error(Random* random, double sigma) noexcept {
  if (sigma == 0.0) return Eigen::Vector3d::Zero();
  const double x = random->normal(), y = random->normal(), z = random->normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

}  // namespace gatefield::simulator
