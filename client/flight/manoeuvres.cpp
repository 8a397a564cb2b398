#include "client/flight/manoeuvres.h"

#include <algorithm>
#include <cmath>

namespace gatefield::flight {
namespace {

constexpr double kLongestStep_s = 0.1;  // a loop that was held up does not jump ahead
constexpr double kLiftGain_s2 = 1.0;    // 1/s^2: half of the velocity's gain squared, well damped
constexpr double kLiftLeak_s = 3.0;     // while the plan flies the thrust estimate learns, and it is needed no more

sdk::Setpoint mixed(double share, const sdk::Setpoint& plan, const sdk::Setpoint& own) noexcept {
  sdk::Setpoint sum = plan;
  sum.thrust_rate_n_s = share * plan.thrust_rate_n_s + (1 - share) * own.thrust_rate_n_s;
  sum.rotor_thrust_n = share * plan.rotor_thrust_n + (1 - share) * own.rotor_thrust_n;
  sum.collective_thrust_n = share * plan.collective_thrust_n + (1 - share) * own.collective_thrust_n;
  sum.body_rates_rad_s = share * plan.body_rates_rad_s + (1 - share) * own.body_rates_rad_s;
  return sum;
}

}  // namespace

Manoeuvres::Manoeuvres(const QuadrotorModel& model, const Actuation& actuation, const Course& course,
                       const SupervisorOptions& options)
    : options_(options),
      mass_kg_(model.mass_kg),
      law_(model, actuation),
      clear_(course, model.collision_radius_m + options.gate_margin_m) {}

std::optional<sdk::Setpoint> Manoeuvres::setpoint(const Directive& directive, Stamp now,
                                                  const std::optional<TimedState>& state,
                                                  const std::optional<ControllerStatus>& controller,
                                                  const sdk::Setpoint& plan) noexcept {
  const bool begins = !directive_ || directive_->phase != directive.phase || directive_->since != directive.since;
  if (begins) begin(directive, now, state);
  const double dt_s = begins ? 0.0 : std::clamp(seconds(now - last_), 0.0, kLongestStep_s);
  directive_ = directive;
  last_ = now;
  if (directive.phase == Phase::kLevelDescent) return level(now, dt_s, controller);
  if (!contains(kByState, directive.phase) || !state) return std::nullopt;
  switch (directive.phase) {
    case Phase::kTakeOff:
      return fly(climb(dt_s, state->state), state->state, dt_s);
    case Phase::kHandOver: {
      sdk::Fallback::Goal goal;
      goal.z_m = state->state.p_WB.z();  // the plan may climb
      const double span_s = seconds(options_.hand_over);
      const double share = span_s > 0 ? std::clamp(seconds(now - directive.since) / span_s, 0.0, 1.0) : 1.0;
      return mixed(share, plan, fly(goal, state->state, dt_s));
    }
    case Phase::kRacing:
      lift_m_s2_ -= lift_m_s2_ * dt_s / kLiftLeak_s;
      return plan;
    case Phase::kBraking:
      return fly(brake(state->state), state->state, dt_s);
    default:
      return fly(hold(state->state, directive.phase == Phase::kDescending, dt_s), state->state, dt_s);
  }
}

sdk::Setpoint Manoeuvres::fly(sdk::Fallback::Goal goal, const QuadrotorState& state, double dt_s) noexcept {
  lift_m_s2_ =
      std::clamp(lift_m_s2_ + dt_s * kLiftGain_s2 * (goal.v_W.z() - state.v_WB.z()), -kMaxLift_m_s2, kMaxLift_m_s2);
  goal.a_W.z() += lift_m_s2_;
  return law_.toward(goal, state);
}

void Manoeuvres::begin(const Directive& directive, Stamp now, const std::optional<TimedState>& state) noexcept {
  if (!state) {
    level_state_ = QuadrotorState{};
    begin_v_z_m_s_ = 0.0;
    return;
  }
  home_W_ = state->state.p_WB.head<2>();
  goal_z_m_ = state->state.p_WB.z();
  top_z_m_ = goal_z_m_ + options_.take_off_height_m;
  if (directive.phase == Phase::kTakeOff) lift_m_s2_ = 0.0;
  if (directive.phase != Phase::kLevelDescent) return;
  level_state_ = state->state;
  begin_v_z_m_s_ = state->state.v_WB.z();
  asked_rates_B_ = state->state.w_WB_B;
  // It turned on since that state held.
  const double age_s = std::clamp(seconds(now - state->stamp), 0.0, kLongestStep_s);
  const Eigen::Vector3d turn = age_s * state->state.w_WB_B;
  if (const double angle = turn.norm(); angle > 1e-9)
    level_state_.q_WB = state->state.q_WB * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
}

sdk::Fallback::Goal Manoeuvres::climb(double dt_s, const QuadrotorState& state) noexcept {
  // The height asked for waits for the vehicle: it must not have run away when the ground lets go.
  const double lead_m = options_.take_off_speed_m_s;
  goal_z_m_ = std::min({goal_z_m_ + options_.take_off_speed_m_s * dt_s, top_z_m_, state.p_WB.z() + lead_m});
  sdk::Fallback::Goal goal;
  goal.v_W.head<2>() = 0.5 * law_.velocity_gain_s() * (home_W_ - state.p_WB.head<2>());
  goal.v_W.z() = goal_z_m_ < top_z_m_ ? options_.take_off_speed_m_s : 0.0;
  goal.z_m = goal_z_m_;
  return goal;
}

sdk::Fallback::Goal Manoeuvres::hold(const QuadrotorState& state, bool sinking, double dt_s) noexcept {
  sdk::Fallback::Goal goal;
  const Eigen::Vector2d drift_W = clear_.drift(state.p_WB, sinking);
  if (drift_W.squaredNorm() > 0) {
    goal.v_W.head<2>() = drift_W;
    home_W_ = state.p_WB.head<2>();
  } else {
    Eigen::Vector2d back_W = 0.5 * law_.velocity_gain_s() * (home_W_ - state.p_WB.head<2>());
    if (const double speed = back_W.norm(); speed > kMaxReturn_m_s) back_W *= kMaxReturn_m_s / speed;
    goal.v_W.head<2>() = back_W;
  }
  if (sinking) {
    goal.v_W.z() = -options_.descent_m_s * (1.0 - drift_W.norm() / sdk::KeepClear::kDrift_m_s);
    goal_z_m_ += goal.v_W.z() * dt_s;
  }
  goal.z_m = goal_z_m_;
  return goal;
}

sdk::Fallback::Goal Manoeuvres::brake(const QuadrotorState& state) const noexcept {
  const Eigen::Vector2d steer_W = clear_.steer(state.p_WB, state.v_WB);
  sdk::Fallback::Goal goal = law_.braking(state, steer_W, 1.0, sdk::Fallback::kMaxBrake_m_s2);
  goal.z_m = goal_z_m_;
  return goal;
}

sdk::Setpoint Manoeuvres::level(Stamp now, double dt_s, const std::optional<ControllerStatus>& controller) noexcept {
  if (controller && controller->q_WB && controller->q_WB->coeffs().allFinite()) {
    level_state_.q_WB = *controller->q_WB;
  } else {
    const Eigen::Vector3d turn = dt_s * asked_rates_B_;
    if (const double angle = turn.norm(); angle > 1e-9)
      level_state_.q_WB = (level_state_.q_WB * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle))).normalized();
  }
  level_state_.w_WB_B = asked_rates_B_;

  const double gone_s = seconds(now - directive_->since);
  const double too_fast_m_s = std::max(0.0, -begin_v_z_m_s_ - kSink_m_s), rising_m_s = std::max(0.0, begin_v_z_m_s_);
  double share = options_.level_thrust;
  if (gone_s < too_fast_m_s / ((kMoreThrust - 1) * kGravity_m_s2)) share = kMoreThrust;
  if (gone_s < rising_m_s / ((1 - kLessThrust) * kGravity_m_s2)) share = kLessThrust;
  sdk::Setpoint setpoint = law_.push({0, 0, share * mass_kg_ * kGravity_m_s2}, level_state_);
  asked_rates_B_ = setpoint.body_rates_rad_s;
  return setpoint;
}

}  // namespace gatefield::flight
