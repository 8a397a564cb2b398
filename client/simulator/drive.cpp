#include "client/simulator/drive.h"

#include <algorithm>

namespace gatefield::simulator {

Result<Drive> Drive::create(const config::Scenario& scenario) {
  const QuadrotorModel& told = scenario.vehicle.quadrotor;
  const Actuation& actuation = scenario.vehicle.actuation;
  const config::Mismatch& mismatch = scenario.mismatch;
  if (actuation.kind == Actuation::Kind::kRotorThrusts) return Drive(scenario, std::nullopt);
  const auto gains = tuned_gains(told, mismatch.rate_lag_factor * actuation.rate_time_constant_s);
  if (!gains) return gains.failure().within("the true rate loop: ");
  const Asked hover{told.mass_kg * kGravity_m_s2, Eigen::Vector3d::Zero()};
  const auto steps = static_cast<std::size_t>(mismatch.setpoint_delay / Plant::kStep);
  return Drive(scenario,
               Controller{RateLoop(told, *gains), std::vector<Asked>(steps + 1, hover), 0, mismatch.rate_limit_rad_s});
}

Drive Drive::through(FlightControllerInLoop* firmware, const config::Scenario& scenario) noexcept {
  Drive drive(scenario, std::nullopt);
  drive.firmware_ = firmware;
  return drive;
}

void Drive::step(const sdk::Setpoint& setpoint, Plant* plant) noexcept {
  if (firmware_ != nullptr) return plant->step_held(thrust_factor_ * firmware_->step(setpoint, plant->state()));
  if (!controller_) return plant->step(thrust_factor_ * setpoint.thrust_rate_n_s);
  auto& [loop, on_the_way, newest, limit_rad_s] = *controller_;
  newest = (newest + 1) % on_the_way.size();
  on_the_way[newest] = {setpoint.collective_thrust_n, setpoint.body_rates_rad_s};
  Asked asked = on_the_way[(newest + 1) % on_the_way.size()];
  for (Eigen::Index i = 0; i < 3; ++i)
    if (limit_rad_s[i] > 0.0)
      asked.body_rates_rad_s[i] = std::clamp(asked.body_rates_rad_s[i], -limit_rad_s[i], limit_rad_s[i]);
  plant->step_held(thrust_factor_ * loop.update(asked.collective_n, asked.body_rates_rad_s, plant->state().w_WB_B));
}

QuadrotorState Drive::known(const QuadrotorState& truth) const noexcept {
  QuadrotorState state = truth;
  if (thrust_known()) {
    state.thrust_n /= thrust_factor_;
    state.thrust_command_n /= thrust_factor_;
  } else {
    state.thrust_n.setZero();
    state.thrust_command_n.setZero();
  }
  return state;
}

}  // namespace gatefield::simulator
