#include "server/pilot/stepping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "server/planner/drive/drive.h"

namespace gatefield::pilot {
namespace {

constexpr double kBraking_m_s2 = 8.0;  // behind the last gate
constexpr double kMaxAge_s = 1e9;      // that a command may tell
// Without a state for longer than this a straight line says little of where the vehicle came through.
constexpr std::chrono::milliseconds kAway{300};

double finite_or(double value, double otherwise) noexcept { return std::isfinite(value) ? value : otherwise; }

/// The limits on body rates of plans of rotor thrusts are soft; what a vehicle is asked for keeps to its own. 0: it has
/// none.
Eigen::Vector3d within(const Eigen::Vector3d& limit_rad_s, Eigen::Vector3d w_WB_B) noexcept {
  for (Eigen::Index i = 0; i < 3; ++i)
    if (limit_rad_s[i] > 0.0) w_WB_B[i] = std::clamp(w_WB_B[i], -limit_rad_s[i], limit_rad_s[i]);
  return w_WB_B;
}

}  // namespace

Stepping::Stepping(const protocol::SessionRequest* request, std::uint64_t session, const std::string& isa,
                   std::unique_ptr<planner::Planner> planner, std::unique_ptr<StepObserver> observer, Mailboxes* shared)
    : request_(request),
      shared_(shared),
      planner_(std::move(planner)),
      observer_(std::move(observer)),
      period_(from_seconds(1.0 / planner_->profile().control_rate_hz)),
      progress_(request->course),
      ahead_(progress_),
      gates_(&progress_.passages()),
      state_watch_(request->quadrotor, !by_rates()),
      drive_watch_(new_drive_watch()) {
  shared_->aim(progress_);
  state_.disturbance = Disturbance(planner_->profile().disturbance_time_s);
  protocol::ThrustRateCommand& command = state_.command;
  command.vehicle = request->vehicle;
  command.session = session;
  command.actuation = request->actuation.kind;
  state_.inputs = nothing_sent();
  command.plan_step = from_seconds(planner_->profile().step_s);
  std::strncpy(command.isa.data(), isa.c_str(), command.isa.size() - 1);
  for (std::size_t k = 0; k < protocol::kMaxPlanSteps; ++k) {
    command.thrust_rate_n_s[k].setZero();
    command.rotor_thrust_n[k].setZero();
    command.collective_thrust_n[k] = 0.0;
    command.body_rates_rad_s[k].setZero();
  }
}

InputTimeline Stepping::nothing_sent() const noexcept {
  return InputTimeline(by_rates() ? hover_command(request_->quadrotor) : PlainVector4(PlainVector4::Zero()));
}

DriveWatch Stepping::new_drive_watch() const noexcept {
  return {request_->actuation, planner::body_rate_limits_rad_s(planner_->profile(), request_->quadrotor)};
}

Dynamics Stepping::dynamics() const noexcept {
  return {request_->quadrotor, request_->actuation, state_.thrust_factor.value()};
}

gates::GateBelief Stepping::planned(std::uint32_t waypoint) const noexcept {
  gates::GateBelief gate = gates_.belief(waypoint);
  if (!planner_->profile().waypoint_from_field) gate.center_W = progress_.nominal(waypoint).center_W;
  return gate;
}

void Stepping::begin_line(const StateSample& sample) noexcept {
  state_.line = sample.line;
  state_.first_stamp = state_.rotors_stamp = sample.stamp;
  state_.inputs = nothing_sent();
  state_.delay = DelayEstimate();
  state_.delay_known = false;
  state_.measured_stamp = Stamp{-1};
  state_.have_plan = false;
  state_watch_ = StateWatch(request_->quadrotor, !by_rates());
  drive_watch_ = new_drive_watch();
  diagnosis_.begin_line();
}

void Stepping::take_in(const StateSample& sample) noexcept {
  const QuadrotorModel& model = request_->quadrotor;
  QuadrotorState& rotors = state_.rotors;
  if (!state_.have_state) {
    state_.have_state = true;
    state_.first_stamp = sample.stamp;
    progress_.resume(sample.heard_waypoint, sample.heard_lap);
  }
  if (sample.line != state_.line) begin_line(sample);
  if (sample.jumps != state_.jumps) {
    state_.jumps = sample.jumps;
    state_.measured_stamp = Stamp{-1};
    progress_.begin_elsewhere();
  }
  if (state_.have_rotors && sample.stamp - state_.rotors_stamp > kAway) progress_.away();
  if (by_rates())
    state_.inputs.tell(state_.have_rotors ? state_.rotors_stamp : sample.stamp, sample.stamp, sample.asked);
  if (sample.thrust_known && !by_rates()) {
    rotors.thrust_n = sample.state.thrust_n;
    rotors.thrust_command_n = sample.state.thrust_command_n;
  } else if (!state_.have_rotors) {
    rotors.thrust_n = rotors.thrust_command_n = hover_thrust_n(model);
  } else {
    predict_rotors(dynamics(), state_.inputs, state_.rotors_stamp, sample.stamp, &rotors);
  }
  // A command beyond the limits would look like an impossible thrust rate when the first step brings it back.
  rotors.thrust_command_n = rotors.thrust_command_n.cwiseMax(model.thrust_min_n).cwiseMin(model.thrust_max_n);
  state_.have_rotors = true;
  state_.rotors_stamp = sample.stamp;
  if (sample.round_trip.count() > 0) {
    if (!state_.delay_known) state_.inputs.begin_at(state_.first_stamp + sample.round_trip);
    state_.delay_known = true;
    state_.delay.round_trip(sample.round_trip);
  }
  QuadrotorState watched = sample.state;
  watched.thrust_n = rotors.thrust_n;
  watched.thrust_command_n = rotors.thrust_command_n;
  contradictions_ = state_watch_.observe(sample.stamp, watched);
  compare_with_prediction(sample);
  const gates::GateBelief target = gates_.belief(progress_.target());
  if (progress_.update(sample.state.p_WB, target)) {
    state_.passed = target;
    state_.passed.field = nullptr;  // its latent makes room for the next gate's
    state_.have_passed = true;
    shared_->aim(progress_);
  }
}

/// What the newest state has that was not predicted from the one before it.
void Stepping::compare_with_prediction(const StateSample& sample) noexcept {
  if (!state_.disturbance.wanted() && !by_rates()) return;
  const Stamp dt = sample.stamp - state_.measured_stamp;
  // Over a real link, as long as its delay is not known it is not known either when what was sent began to hold.
  const bool inputs_known = lockstep() || state_.delay_known;
  if (inputs_known && state_.measured_stamp >= Stamp{0} && dt > Stamp{0} && dt <= Disturbance::kLongestGap) {
    const QuadrotorState before = state_.measured;
    predict(dynamics(), state_.inputs, state_.measured_stamp, sample.stamp, Eigen::Vector3d::Zero(), &state_.measured);
    Eigen::Vector3d missed_W = sample.state.v_WB - state_.measured.v_WB;
    if (by_rates()) {
      const bool asked_known = state_.inputs.covers(state_.measured_stamp, sample.stamp);
      if (asked_known)
        state_.thrust_factor.observe(before, state_.measured, sample.state.v_WB, request_->quadrotor.mass_kg, dt);
      watch_drive(sample, asked_known);
      const Eigen::Vector3d z_W = thrust_axis_W(before, state_.measured);
      missed_W -= z_W.dot(missed_W) * z_W;
    }
    state_.disturbance.observe(missed_W, dt);
  } else {
    drive_watch_.interrupt(sample.state.w_WB_B);
  }
  state_.measured = sample.state;
  state_.measured.thrust_n = state_.rotors.thrust_n;
  state_.measured.thrust_command_n = state_.rotors.thrust_command_n;
  state_.measured_stamp = sample.stamp;
}

void Stepping::watch_drive(const StateSample& sample, bool asked_known) noexcept {
  if (!asked_known) return drive_watch_.interrupt(sample.state.w_WB_B);
  state_.inputs.visit(state_.measured_stamp, sample.stamp, [this](const RateCommand& asked, Stamp from, Stamp to) {
    drive_watch_.follow(asked, to - from);
  });
  drive_watch_.observe(sample.state.w_WB_B, sample.stamp - state_.measured_stamp);
}

/// Behind the last gate, as far as braking takes, at the gate's height.
void Stepping::hold_behind(const planner::PlanInput& input) noexcept {
  gates::GateBelief& hold = state_.hold;
  hold = gates::GateBelief{};
  Eigen::Vector3d away_W = input.target.axis_W;
  away_W.z() = 0.0;
  const double brake_m = std::clamp(input.start.v_WB.squaredNorm() / (2.0 * kBraking_m_s2), 1.0, 6.0);
  hold.center_W = input.target.center_W;
  if (away_W.norm() > 1e-6) hold.center_W += brake_m * away_W.normalized();
  hold.axis_W = input.target.axis_W;
  hold.shape = input.target.shape;
}

void Stepping::read_state() noexcept {
  if (const StateSample* const sample = shared_->states.read()) {
    state_.newest = *sample;
    state_.state_is_new = true;
  }
}

void Stepping::read_beliefs() noexcept {
  if (const gates::Snapshot* const snapshot = shared_->beliefs.read()) gates_.take(snapshot);
}

void Stepping::absorb() noexcept {
  read_state();
  read_beliefs();
}

Stepping::Answer Stepping::step(Stamp now) noexcept {
  unsolved_ = false;
  read_state();
  const StateSample& newest = state_.newest;
  if (!state_.have_state && !state_.state_is_new) return {};

  bool degraded = shared_->newest_state_rejected.load(std::memory_order_relaxed);
  std::chrono::nanoseconds age{0};
  if (lockstep()) {
    const bool repeat = shared_->repeat_wanted.load(std::memory_order_acquire);
    if (!state_.state_is_new && !repeat) return {};
    if (!state_.state_is_new && state_.command_good) {
      shared_->repeat_wanted.store(false, std::memory_order_relaxed);
      return {&state_.command, kNever};
    }
    const std::uint64_t named = newest.depth_sequence;
    if (named > shared_->frame_processed.load(std::memory_order_acquire)) {
      degraded = true;
      const Stamp give_up = newest.received + kDepthWait;
      if (named != shared_->frame_refused.load(std::memory_order_acquire) && now < give_up) return {nullptr, give_up};
    }
    shared_->repeat_wanted.store(false, std::memory_order_relaxed);
  } else {
    age = std::max(now - newest.received, std::chrono::nanoseconds{0});
    states_missing_ = age > 2 * period_;
    if (age > kSilence) {
      states_missing_ = true;
      state_.command.health.problems = diagnose(0.0, Withheld::kNothing);
      state_.command.health.degraded = true;
      shared_->healths.write(state_.command.health);
      return {};
    }
    if (states_missing_) degraded = true;
  }

  read_beliefs();
  state_.first_answer = state_.state_is_new;
  if (state_.state_is_new) take_in(newest);
  state_.state_is_new = false;

  std::chrono::nanoseconds horizon{0};
  if (planner_->profile().predict_delay) horizon = lockstep() ? state_.delay.whole() : age + state_.delay.ahead();
  const Stamp plan_start = newest.stamp + horizon;
  planner::PlanInput input;
  input.start = newest.state;
  input.start.thrust_n = state_.rotors.thrust_n;
  input.start.thrust_command_n = state_.rotors.thrust_command_n;
  input.disturbance_W_m_s2 = state_.disturbance.acceleration_W_m_s2();
  input.thrust_factor = state_.thrust_factor.value();
  predict(dynamics(), state_.inputs, newest.stamp, plan_start, input.disturbance_W_m_s2, &input.start);
  if (by_rates()) input.asked = state_.inputs.at(plan_start);

  // Between now and the plan's start the vehicle may fly through the gate: then the plan is for the gate after it. Only
  // what was measured counts as passed, though.
  ahead_ = progress_;
  input.passed_gate = state_.passed;
  input.has_passed_gate = state_.have_passed;
  const gates::GateBelief before = gates_.belief(ahead_.target());
  if (ahead_.update(input.start.p_WB, before)) {
    input.passed_gate = before;
    input.passed_gate.field = nullptr;
    input.has_passed_gate = true;
  }

  input.elapsed_s = state_.have_plan ? std::max(0.0, seconds(plan_start - state_.last_plan_start)) : 0.0;
  input.step = state_.steps_made++;
  input.target = planned(ahead_.target());
  input.has_next = ahead_.has_next();
  input.next = planned(ahead_.next());
  const double field_age_s = gates_.age_s(ahead_.target(), plan_start);
  input.field_age_s = std::max(0.0, field_age_s);
  input.speed_limit_m_s = request_->speed_limit_m_s;
  input.hold = ahead_.done();
  if (input.hold) {
    if (!state_.holding) hold_behind(input);
    input.target = state_.hold;
  }
  state_.holding = input.hold;

  if (observer_) planner_->watch(observer_->rollouts(input.step));
  planner_->plan(input, &plan_);
  state_.have_plan = true;
  state_.last_plan_start = plan_start;
  if (observer_) {
    const gates::GateBelief believed = input.hold ? state_.hold : gates_.belief(ahead_.target());
    observer_->made({plan_start, ahead_.target(), believed, input, plan_});
  }

  const Withheld withheld = why_withheld(request_->quadrotor, request_->actuation.kind, plan_);
  state_.command_good = withheld == Withheld::kNothing;
  fill_health(horizon, field_age_s, degraded, withheld);
  if (!state_.command_good) {
    // The client goes on along the plan that it has; what led here must not come back by the warm start.
    planner_->reset();
    state_.have_plan = false;
    shared_->account.withhold(withheld);
    shared_->healths.write(state_.command.health);
    return {};
  }
  fill_command(plan_start);
  unsolved_ = true;
  return {&state_.command, kNever};
}

void Stepping::fill_command(Stamp plan_start) noexcept {
  protocol::ThrustRateCommand& command = state_.command;
  const int steps = std::min(plan_.steps, protocol::kMaxPlanSteps);
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    if (by_rates()) {
      command.collective_thrust_n[k] = plan_.rate_command[k][0];
      command.body_rates_rad_s[k] = plan_.rate_command[k].tail<3>();
    } else {
      command.thrust_rate_n_s[k] = plan_.thrust_rate_n_s[k];
      command.rotor_thrust_n[k] = plan_.state[k].thrust_command_n;
      command.collective_thrust_n[k] = plan_.state[k].thrust_command_n.sum();
      command.body_rates_rad_s[k] = within(request_->quadrotor.body_rate_max_rad_s, plan_.state[k].w_WB_B);
    }
  }
  ++command.sequence;
  command.answers_sequence = state_.newest.sequence;
  command.answers_stamp = state_.newest.stamp;
  command.plan_start = plan_start;
  command.steps = steps;
  command.validity = std::min<Stamp>(steps * command.plan_step, kMaxValidity);
  const PlainVector4* const sent = by_rates() ? plan_.rate_command.data() : plan_.thrust_rate_n_s.data();
  state_.inputs.add(plan_start, command.plan_step, {sent, static_cast<std::size_t>(steps)}, command.validity);
}

void Stepping::fill_health(std::chrono::nanoseconds horizon, double field_age_s, bool degraded,
                           Withheld withheld) noexcept {
  protocol::PlannerHealth& health = state_.command.health;
  health.effective_samples = std::clamp(finite_or(plan_.effective_samples, 0.0), 0.0, 1e9);
  health.lowest_field_m = std::clamp(finite_or(plan_.lowest_field_m, 0.0), -1e6, 1e6);
  health.latent_age_s = std::min(field_age_s, kMaxAge_s);
  health.state_age_s = seconds(horizon);
  health.target_waypoint = progress_.target();
  health.lap = progress_.lap();
  health.course_done = progress_.done();
  health.degraded = degraded || depth_missing() || !plan_.ok || withheld != Withheld::kNothing;
  health.problems = diagnose(plan_.ok ? health.effective_samples : 0.0, withheld);
}

bool Stepping::depth_missing() const noexcept {
  // Of another time line, the frame's stamp says nothing.
  const bool of_this_line = shared_->good_frame_line.load(std::memory_order_acquire) == state_.line;
  const Stamp good_frame{shared_->good_frame_stamp.load(std::memory_order_relaxed)};
  const Stamp seen_until = of_this_line && good_frame >= Stamp{0} ? good_frame : state_.first_stamp;
  return state_.newest.stamp - seen_until > kDepthMissing;
}

bool Stepping::target_should_be_seen() const noexcept {
  const CameraModel& camera = request_->camera;
  const QuadrotorState& vehicle = state_.newest.state;
  const Eigen::Vector3d center_W = gates_.belief(progress_.target()).center_W;
  const Eigen::Vector3d center_B = vehicle.q_WB.conjugate() * (center_W - vehicle.p_WB);
  const Eigen::Vector3d center_C = camera.X_BC.inverse() * center_B;
  return center_C.norm() <= kSeenWithin_m && camera.sees(center_C, kSeenMargin_px_per_width * camera.width_px);
}

protocol::Problems Stepping::diagnose(double effective_samples, Withheld withheld) noexcept {
  const DelayEstimate& delay = state_.delay;
  StepFindings findings;
  findings.stamp = state_.newest.stamp;
  findings.effective_samples = effective_samples;
  findings.gate_seen = gates_.belief(progress_.target()).seen;
  findings.gate_expected = !findings.gate_seen && target_should_be_seen();
  findings.course_done = progress_.done();
  findings.depth_missing = depth_missing();
  findings.states_missing = states_missing_;
  findings.states_rejected = shared_->motion_jumped.exchange(false, std::memory_order_relaxed) ||
                             shared_->newest_state_rejected.load(std::memory_order_relaxed);
  findings.frames_rejected = shared_->newest_frame_rejected.load(std::memory_order_relaxed);
  findings.stamps_jumped = shared_->stamps_jumped.exchange(false, std::memory_order_relaxed);
  findings.delay_long = (lockstep() ? delay.whole() : delay.ahead()) >= DelayEstimate::kMaxDelay;
  findings.deadlines_missed = shared_->account.deadlines_missed.load(std::memory_order_relaxed);
  findings.withheld = problems(withheld);
  findings.contradictions = contradictions_;
  if (by_rates()) findings.contradictions |= drive_watch_.problems(state_.thrust_factor);
  findings.sensing = shared_->sensing_problems.load(std::memory_order_relaxed);
  return diagnosis_.step(findings);
}

void Stepping::solved(std::chrono::nanoseconds took) noexcept {
  if (!unsolved_) return;  // the command came again, or there is none
  unsolved_ = false;
  const std::chrono::nanoseconds solve = std::max(took, std::chrono::nanoseconds{0});
  state_.delay.solve(solve);
  shared_->account.steps.add(solve);
  state_.command.health.solve_time_s = seconds(solve);
  shared_->healths.write(state_.command.health);
  if (!by_rates()) return;
  drive_watch_.fill(state_.thrust_factor, &identified_);
  shared_->drives.write(identified_);
}

void Stepping::sent_elsewhere(const protocol::ThrustRateCommand& command) noexcept {
  if (command.sequence <= state_.command.sequence) return;
  state_.command.sequence = command.sequence;
  std::array<PlainVector4, protocol::kMaxPlanSteps> inputs;
  const auto steps = static_cast<std::size_t>(std::clamp(command.steps, 0, protocol::kMaxPlanSteps));
  for (std::size_t k = 0; k < steps; ++k) {
    if (by_rates())
      inputs[k] << command.collective_thrust_n[k], command.body_rates_rad_s[k];
    else
      inputs[k] = command.thrust_rate_n_s[k];
  }
  state_.inputs.add(command.plan_start, command.plan_step, {inputs.data(), steps}, command.validity);
}

void Stepping::sent(Stamp now, bool ok) noexcept {
  if (!ok) {
    Account::count(shared_->account.commands_lost);
    return;
  }
  Account::count(shared_->account.commands_sent);
  if (state_.first_answer) state_.delay.residence(std::max(now - state_.newest.received, std::chrono::nanoseconds{0}));
  state_.first_answer = false;
}

}  // namespace gatefield::pilot
