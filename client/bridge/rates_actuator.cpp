#include "client/bridge/rates_actuator.h"

namespace gatefield::bridge {

void RatesActuator::apply(Stamp now, const sdk::Setpoint& setpoint) noexcept {
  send(now, setpoint.body_rates_rad_s, thrust_.command(now, setpoint.collective_thrust_n));
}

void RatesActuator::hold(Stamp now) noexcept {
  const double throttle = in_the_air(now) ? thrust_.command(now, weight_n_) : 0.0;
  send(now, Eigen::Vector3d::Zero(), throttle);
}

bool RatesActuator::in_the_air(Stamp now) noexcept {
  const auto status = this->status(now);
  const auto state = this->state();
  if (!status || !status->armed) {
    if (state) ground_z_m_ = state->state.p_WB.z();
    return false;
  }
  if (status->on_ground) return !*status->on_ground;
  return state && ground_z_m_ && state->state.p_WB.z() - *ground_z_m_ > kLifted_m;
}

}  // namespace gatefield::bridge
