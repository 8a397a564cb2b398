#include "client/sdk/plan_player.h"

#include <algorithm>

namespace gatefield::sdk {

void PlanPlayer::take(const protocol::ThrustRateCommand& command) noexcept {
  for (Plan& plan : plans_)
    if (plan.start >= command.plan_start) plan.steps = 0;  // would begin later than its successor: never played
  newest_ = (newest_ + 1) % plans_.size();
  Plan& plan = plans_[newest_];
  plan.start = command.plan_start;
  plan.step = command.plan_step;
  plan.steps = std::clamp(command.steps, 0, protocol::kMaxPlanSteps);
  plan.kind = command.actuation;
  plan.end = command.plan_start + std::min<Stamp>(command.validity, plan.steps * command.plan_step);
  for (std::size_t k = 0; k < static_cast<std::size_t>(plan.steps); ++k) {
    plan.thrust_rate_n_s[k] = command.thrust_rate_n_s[k];
    plan.rotor_thrust_n[k] = command.rotor_thrust_n[k];
    plan.collective_thrust_n[k] = command.collective_thrust_n[k];
    plan.body_rates_rad_s[k] = command.body_rates_rad_s[k];
  }
}

std::optional<Setpoint> PlanPlayer::at(Stamp now, Stamp period) const noexcept {
  for (std::size_t age = 0; age < plans_.size(); ++age) {
    const Plan& plan = plans_[(newest_ + plans_.size() - age) % plans_.size()];
    if (plan.steps == 0 || now < plan.start) continue;
    if (now >= plan.end) return std::nullopt;
    return point(plan, now, period);
  }
  const Plan& newest = plans_[newest_];
  if (newest.steps > 0 && newest.end > newest.start && now >= newest.start - newest.step)
    return point(newest, newest.start, period);
  return std::nullopt;
}

Setpoint PlanPlayer::point(const Plan& plan, Stamp now, Stamp period) noexcept {
  const auto interval = [&plan](Stamp elapsed) {
    return std::clamp<std::int64_t>(elapsed / plan.step, 0, plan.steps - 1);
  };
  Setpoint setpoint;
  setpoint.source = Setpoint::Source::kPlan;
  const auto holds = static_cast<std::size_t>(interval(now - plan.start));
  if (plan.kind == Actuation::Kind::kBodyRates) {
    setpoint.collective_thrust_n = plan.collective_thrust_n[holds];
    setpoint.body_rates_rad_s = plan.body_rates_rad_s[holds];
    return setpoint;
  }
  setpoint.thrust_rate_n_s = plan.thrust_rate_n_s[holds];

  const Stamp elapsed = std::min<Stamp>(now + period - plan.start, plan.steps * plan.step);
  const auto k = static_cast<std::size_t>(interval(elapsed));
  const double remaining_s = seconds(plan.step * (interval(elapsed) + 1) - elapsed);
  if (k == 0) {
    setpoint.rotor_thrust_n = plan.rotor_thrust_n[0] - remaining_s * plan.thrust_rate_n_s[0];
    setpoint.body_rates_rad_s = plan.body_rates_rad_s[0];
  } else {
    // Not along the rate: a rotor that reached its limit stops there, and its rate does not say so.
    const double before = remaining_s / seconds(plan.step);
    setpoint.rotor_thrust_n = before * plan.rotor_thrust_n[k - 1] + (1 - before) * plan.rotor_thrust_n[k];
    setpoint.body_rates_rad_s = before * plan.body_rates_rad_s[k - 1] + (1 - before) * plan.body_rates_rad_s[k];
  }
  setpoint.collective_thrust_n = setpoint.rotor_thrust_n.sum();
  return setpoint;
}

}  // namespace gatefield::sdk
