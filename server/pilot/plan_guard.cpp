#include "server/pilot/plan_guard.h"

#include <algorithm>

#include "common/protocol/messages.h"

namespace gatefield::pilot {
namespace {

constexpr double kLimitSlack = 1e-3;        // rounding between single and double precision
constexpr double kMaxBodyRate_rad_s = 200;  // protocol::validate refuses more

Withheld check_rates(const QuadrotorModel& model, const RateCommand& command, const QuadrotorState& state) noexcept {
  if (!command.allFinite() || !state.p_WB.allFinite() || !state.w_WB_B.allFinite()) return Withheld::kNotFinite;
  if (command[0] < kRotors * model.thrust_min_n - kLimitSlack ||
      command[0] > kRotors * model.thrust_max_n + kLimitSlack)
    return Withheld::kThrustLimit;
  return command.tail<3>().norm() < kMaxBodyRate_rad_s ? Withheld::kNothing : Withheld::kBodyRate;
}

}  // namespace

Withheld why_withheld(const QuadrotorModel& model, Actuation::Kind kind, const planner::Plan& plan) noexcept {
  const int steps = std::min(plan.steps, protocol::kMaxPlanSteps);
  if (steps < 1) return Withheld::kNotFinite;
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    if (kind == Actuation::Kind::kBodyRates) {
      const Withheld why = check_rates(model, plan.rate_command[k], plan.state[k]);
      if (why != Withheld::kNothing) return why;
      continue;
    }
    const ThrustRates& rates = plan.thrust_rate_n_s[k];
    const QuadrotorState& state = plan.state[k];
    if (!rates.allFinite() || !state.thrust_command_n.allFinite() || !state.w_WB_B.allFinite())
      return Withheld::kNotFinite;
    if (rates.cwiseAbs().maxCoeff() > model.thrust_rate_max_n_s + kLimitSlack) return Withheld::kRateLimit;
    if (state.thrust_command_n.minCoeff() < model.thrust_min_n - kLimitSlack ||
        state.thrust_command_n.maxCoeff() > model.thrust_max_n + kLimitSlack)
      return Withheld::kThrustLimit;
    if (!(state.w_WB_B.norm() < kMaxBodyRate_rad_s)) return Withheld::kBodyRate;
  }
  return Withheld::kNothing;
}

protocol::Problems problems(Withheld why) noexcept {
  using protocol::bit;
  using protocol::Problem;
  switch (why) {
    case Withheld::kNothing:
      return 0;
    case Withheld::kNotFinite:
      return bit(Problem::kPlanNotFinite);
    case Withheld::kRateLimit:
      return bit(Problem::kPlanThrustRate);
    case Withheld::kThrustLimit:
      return bit(Problem::kPlanThrust);
    case Withheld::kBodyRate:
      return bit(Problem::kPlanBodyRate);
  }
  return 0;
}

const char* sentence(Withheld why) noexcept {
  switch (why) {
    case Withheld::kNothing:
      return "";
    case Withheld::kNotFinite:
      return "a plan was withheld: its inputs or predicted states were not finite";
    case Withheld::kRateLimit:
      return "a plan was withheld: a thrust rate was beyond the vehicle's limit";
    case Withheld::kThrustLimit:
      return "a plan was withheld: a thrust was beyond the vehicle's limits";
    case Withheld::kBodyRate:
      return "a plan was withheld: a body rate was beyond 200 rad/s";
  }
  return "";
}

}  // namespace gatefield::pilot
