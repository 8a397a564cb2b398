#include "client/flight/supervision.h"

namespace gatefield::flight {

std::optional<sdk::Setpoint> Supervision::step(Stamp now, const Observation& observation,
                                               const sdk::Setpoint& plan) noexcept {
  const Directive& directive = supervisor_.update(now, observation);
  if (thrust_ != nullptr) learn(observation);
  return manoeuvres_.setpoint(directive, now, supervisor_.state(), observation.controller, plan);
}

bool Supervision::off_the_ground() const noexcept {
  constexpr double kClear_m = 0.1;
  const std::optional<double> ground_z_m = supervisor_.ground_z_m();
  return !ground_z_m || !supervisor_.state() || supervisor_.state()->state.p_WB.z() > *ground_z_m + kClear_m;
}

void Supervision::learn(const Observation& observation) noexcept {
  const Phase phase = directive().phase;
  if (observation.controller && observation.controller->battery_v)
    thrust_->on_battery(*observation.controller->battery_v);
  // On the ground, thrust and acceleration have nothing to do with each other; without a state, neither has attitude.
  if (!contains(kInTheAir, phase) || phase == Phase::kLevelDescent) return thrust_->end();
  if (!supervisor_.state() || (phase == Phase::kTakeOff && !off_the_ground())) return;
  thrust_->begin();
  const auto force = observation.controller ? observation.controller->specific_force_z_m_s2 : std::nullopt;
  thrust_->on_state(supervisor_.state()->stamp, supervisor_.state()->state, force);
}

}  // namespace gatefield::flight
