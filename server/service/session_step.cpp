// The control step: from the newest state and what is known of the gates to the command to send.

#include <algorithm>
#include <cmath>

#include "server/service/session.h"

namespace gatefield::service {
namespace {

double finite_or(double value, double otherwise) noexcept { return std::isfinite(value) ? value : otherwise; }

}  // namespace

planner::GateBelief Session::planned_gate(std::uint32_t waypoint) const noexcept {
  return planner_->profile().waypoint_from_field ? gates_.belief(waypoint) : gates_.belief_at_nominal_center(waypoint);
}

void Session::take_in(const StateSample& sample) noexcept {
  if (!have_state_) {
    have_state_ = true;
    first_stamp_ = sample.stamp;
    progress_.resume(sample.heard_waypoint, sample.heard_lap);
  }
  if (sample.thrust_known) {
    rotors_.thrust_n = sample.state.thrust_n;
    rotors_.thrust_command_n = sample.state.thrust_command_n;
  } else if (!have_rotors_) {
    rotors_.thrust_n = rotors_.thrust_command_n = hover_thrust_n(request_.quadrotor);
  } else {
    predict_rotors(request_.quadrotor, inputs_, rotors_stamp_, sample.stamp, &rotors_);
  }
  // A command beyond the limits would look like an impossible thrust rate when the first step brings it back.
  rotors_.thrust_command_n =
      rotors_.thrust_command_n.cwiseMax(request_.quadrotor.thrust_min_n).cwiseMin(request_.quadrotor.thrust_max_n);
  have_rotors_ = true;
  rotors_stamp_ = sample.stamp;
  if (sample.round_trip.count() > 0) {
    if (!delay_known_) inputs_.begin_at(first_stamp_ + sample.round_trip);
    delay_known_ = true;
    delay_.round_trip(sample.round_trip);
  }
  watch_disturbance(sample);
  const planner::GateBelief target = gates_.belief(progress_.target());
  if (progress_.update(sample.state.p_WB, target)) {
    leave(target);
    publish_target(progress_);
  }
}

void Session::watch_disturbance(const StateSample& sample) noexcept {
  if (!disturbance_.wanted()) return;
  const Stamp dt = sample.stamp - measured_stamp_;
  // Over a real link, as long as its delay is not known it is not known either when what was sent began to hold.
  const bool inputs_known = lockstep() || delay_known_;
  if (inputs_known && measured_stamp_ >= Stamp{0} && dt > Stamp{0} && dt <= Disturbance::kLongestGap) {
    predict(request_.quadrotor, inputs_, measured_stamp_, sample.stamp, Eigen::Vector3d::Zero(), &measured_);
    disturbance_.observe(sample.state.v_WB - measured_.v_WB, dt);
  }
  measured_ = sample.state;
  measured_.thrust_n = rotors_.thrust_n;
  measured_.thrust_command_n = rotors_.thrust_command_n;
  measured_stamp_ = sample.stamp;
}

void Session::leave(const planner::GateBelief& gate) noexcept {
  left_ = gate;
  left_.field = nullptr;  // its latent makes room for the next gate's
  have_left_ = true;
}

Session::Answer Session::step(Stamp now) noexcept {
  if (const StateSample* const sample = states_.read()) {
    newest_ = *sample;
    state_is_new_ = true;
  }
  if (!have_state_ && !state_is_new_) return {};

  bool degraded = newest_state_rejected_.load(std::memory_order_relaxed);
  std::chrono::nanoseconds age{0};
  if (lockstep()) {
    const bool repeat = repeat_wanted_.load(std::memory_order_acquire);
    if (!state_is_new_ && !repeat) return {};
    if (!state_is_new_ && command_good_) {
      repeat_wanted_.store(false, std::memory_order_relaxed);
      return {&command_, kNever};
    }
    const std::uint64_t named = newest_.depth_sequence;
    if (named > frame_processed_.load(std::memory_order_acquire)) {
      degraded = true;
      const Stamp give_up = newest_.received + kDepthWait;
      if (named != frame_refused_.load(std::memory_order_acquire) && now < give_up) return {nullptr, give_up};
    }
    repeat_wanted_.store(false, std::memory_order_relaxed);
  } else {
    age = std::max(now - newest_.received, std::chrono::nanoseconds{0});
    if (age > kSilence) return {};
    if (age > 2 * period_) degraded = true;
  }

  const Stamp begin = clock_->now();
  if (const perception::MemorySnapshot* const memory = memories_.read()) gates_.take(memory);
  first_answer_ = state_is_new_;
  if (state_is_new_) take_in(newest_);
  state_is_new_ = false;

  std::chrono::nanoseconds horizon{0};
  if (planner_->profile().predict_delay) horizon = lockstep() ? delay_.whole() : age + delay_.ahead();
  const Stamp plan_start = newest_.stamp + horizon;
  planner::PlanInput input;
  input.start = newest_.state;
  input.start.thrust_n = rotors_.thrust_n;
  input.start.thrust_command_n = rotors_.thrust_command_n;
  input.disturbance_W_m_s2 = disturbance_.acceleration_W_m_s2();
  predict(request_.quadrotor, inputs_, newest_.stamp, plan_start, input.disturbance_W_m_s2, &input.start);

  // Between now and the plan's start the vehicle may fly through the gate: then the plan is for the gate after it. Only
  // what was measured counts as passed, though.
  ahead_ = progress_;
  input.passed_gate = left_;
  input.has_passed_gate = have_left_;
  const planner::GateBelief before = gates_.belief(ahead_.target());
  if (ahead_.update(input.start.p_WB, before)) {
    input.passed_gate = before;
    input.passed_gate.field = nullptr;
    input.has_passed_gate = true;
  }

  input.elapsed_s = have_plan_ ? std::max(0.0, seconds(plan_start - last_plan_start_)) : 0.0;
  input.step = steps_made_++;
  input.target = planned_gate(ahead_.target());
  input.stamp = plan_start;
  input.waypoint = ahead_.target();
  input.has_next = ahead_.has_next();
  input.next = planned_gate(ahead_.next());
  const double field_age_s = gates_.age_s(ahead_.target(), plan_start);
  input.field_age_s = std::max(0.0, field_age_s);
  input.speed_limit_m_s = request_.speed_limit_m_s;
  input.hold = ahead_.done();
  if (input.hold) {
    if (!holding_) {
      // Behind the last gate, as far as braking takes, at the gate's height.
      hold_ = planner::GateBelief{};
      Eigen::Vector3d away_W = input.target.axis_W;
      away_W.z() = 0.0;
      const double brake_m = std::clamp(input.start.v_WB.squaredNorm() / (2.0 * 8.0), 1.0, 6.0);
      hold_.center_W = input.target.center_W;
      if (away_W.norm() > 1e-6) hold_.center_W += brake_m * away_W.normalized();
      hold_.axis_W = input.target.axis_W;
    }
    input.target = hold_;
  }
  holding_ = input.hold;

  planner_->plan(input, &plan_);
  have_plan_ = true;
  last_plan_start_ = plan_start;

  const Withheld withheld = why_withheld(request_.quadrotor, plan_);
  command_good_ = withheld == Withheld::kNothing;
  if (!command_good_) {
    // The client goes on along the plan that it has; what led here must not come back by the warm start.
    planner_->reset();
    have_plan_ = false;
    account_.withhold(withheld);
    return {};
  }
  fill_command(plan_start, plan_);
  inputs_.add(plan_start, command_.plan_step,
              {command_.thrust_rate_n_s.data(), static_cast<std::size_t>(command_.steps)}, command_.validity);

  const std::int64_t good_frame = good_frame_stamp_.load(std::memory_order_relaxed);
  const Stamp seen_until = good_frame < 0 ? first_stamp_ : Stamp{good_frame};
  if (newest_.stamp - seen_until > kDepthMissing || !plan_.ok) degraded = true;

  protocol::PlannerHealth& health = command_.health;
  health.effective_samples = std::clamp(finite_or(plan_.effective_samples, 0.0), 0.0, 1e9);
  health.lowest_field_m = std::clamp(finite_or(plan_.lowest_field_m, 0.0), -1e6, 1e6);
  health.latent_age_s = field_age_s;
  health.state_age_s = seconds(horizon);
  health.target_waypoint = progress_.target();
  health.lap = progress_.lap();
  health.course_done = progress_.done();
  health.degraded = degraded;
  const std::chrono::nanoseconds solve = std::max(clock_->now() - begin, std::chrono::nanoseconds{0});
  delay_.solve(solve);
  health.solve_time_s = seconds(solve);
  healths_.write(health);
  return {&command_, kNever};
}

void Session::fill_command(Stamp plan_start, const planner::Plan& plan) noexcept {
  const int steps = std::min(plan.steps, protocol::kMaxPlanSteps);
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    command_.thrust_rate_n_s[k] = plan.thrust_rate_n_s[k];
    command_.rotor_thrust_n[k] = plan.state[k].thrust_command_n;
    command_.collective_thrust_n[k] = plan.state[k].thrust_command_n.sum();
    command_.body_rates_rad_s[k] = plan.state[k].w_WB_B;
  }
  ++command_.sequence;
  command_.answers_sequence = newest_.sequence;
  command_.answers_stamp = newest_.stamp;
  command_.plan_start = plan_start;
  command_.steps = steps;
  command_.validity = std::min<Stamp>(steps * command_.plan_step, kLongestValidity);
}

void Session::sent(Stamp now, bool ok) noexcept {
  if (!ok) {
    Account::count(account_.commands_lost);
    return;
  }
  Account::count(account_.commands_sent);
  if (first_answer_) delay_.residence(std::max(now - newest_.received, std::chrono::nanoseconds{0}));
  first_answer_ = false;
}

}  // namespace gatefield::service
