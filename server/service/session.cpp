#include "server/service/session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>

#include "common/protocol/validate.h"

namespace gatefield::service {
namespace {

constexpr double kLimitSlack = 1e-3;         // rounding between single and double precision
constexpr double kMostBodyRate_rad_s = 200;  // protocol::validate refuses more

constexpr std::uint64_t pack(std::uint32_t target, std::uint32_t next) noexcept {
  return std::uint64_t{next} << 32 | target;
}

std::string milliseconds_text(std::chrono::nanoseconds span) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.1f ms", 1e3 * seconds(span));
  return buffer;
}

double finite_or(double value, double otherwise) noexcept { return std::isfinite(value) ? value : otherwise; }

const char* sentence(int withheld) noexcept {
  switch (withheld) {
    case 1:
      return "a plan was withheld: its inputs or predicted states were not finite";
    case 2:
      return "a plan was withheld: a thrust rate was beyond the vehicle's limit";
    case 3:
      return "a plan was withheld: a rotor thrust was beyond the vehicle's limits";
    case 4:
      return "a plan was withheld: a body rate was beyond 200 rad/s";
    default:
      return "";
  }
}

}  // namespace

Session::Session(SessionParts parts)
    : request_(std::move(parts.request)),
      id_(parts.id),
      clock_(parts.clock),
      period_(from_seconds(1.0 / parts.planner->profile().control_rate_hz)),
      isa_(std::move(parts.isa)),
      last_heard_(parts.clock->now().count()),
      sight_(request_.camera, request_.course, std::move(parts.memory), parts.sight),
      planner_(std::move(parts.planner)),
      progress_(request_.course),
      ahead_(request_.course),
      disturbance_(planner_->profile().disturbance_time_s) {
  target_.store(pack(progress_.target(), progress_.next()), std::memory_order_relaxed);
  command_.vehicle = request_.vehicle;
  command_.session = id_;
  command_.plan_step = from_seconds(planner_->profile().step_s);
  std::strncpy(command_.isa.data(), isa_.c_str(), command_.isa.size() - 1);
  for (std::size_t k = 0; k < protocol::kMaxPlanSteps; ++k) {
    command_.thrust_rate_n_s[k].setZero();
    command_.rotor_thrust_n[k].setZero();
    command_.collective_thrust_n[k] = 0.0;
    command_.body_rates_rad_s[k].setZero();
  }
}

// ---- receiving side -------------------------------------------------------------------------------------------------

Status Session::check(const protocol::VehicleState& state) const {
  if (auto s = protocol::validate(state); !s) return s;
  if (state.session != id_)
    return Error{"session is " + std::to_string(state.session) + ", expected " + std::to_string(id_)};
  if (state.sequence <= last_state_sequence_)
    return Error{"sequence is " + std::to_string(state.sequence) + ", expected more than " +
                 std::to_string(last_state_sequence_) + " (states must rise)"};
  if (last_state_sequence_ != 0 && state.stamp <= last_state_stamp_)
    return Error{"stamp is " + std::to_string(state.stamp.count()) + " ns, expected later than " +
                 std::to_string(last_state_stamp_.count()) + " ns (time went backwards)"};
  return {};
}

Session::Intake Session::take_state(const protocol::VehicleState& state) {
  const Stamp now = clock_->now();
  const std::lock_guard lock(states_mutex_);
  states_received_.fetch_add(1, std::memory_order_relaxed);
  if (lockstep() && state.session == id_ && state.sequence == last_state_sequence_ && state.sequence != 0 &&
      state.stamp == last_state_stamp_) {
    last_heard_.store(now.count(), std::memory_order_relaxed);
    repeat_wanted_.store(true, std::memory_order_release);
    return Intake::kRepeated;
  }
  if (const Status status = check(state); !status) {
    states_rejected_.fetch_add(1, std::memory_order_relaxed);
    if (state.session == id_) newest_state_rejected_.store(true, std::memory_order_relaxed);
    note("state: " + status.error());
    return Intake::kRejected;
  }
  if (last_state_sequence_ == 0) {
    // A vehicle in mid-race that lost its server says where it was; perception has to know before the first plan does.
    planner::CourseProgress from(request_.course);
    from.resume(state.heard_waypoint, state.heard_lap);
    target_.store(pack(from.target(), from.next()), std::memory_order_relaxed);
  }
  last_state_sequence_ = state.sequence;
  last_state_stamp_ = state.stamp;
  last_heard_.store(now.count(), std::memory_order_relaxed);
  newest_state_rejected_.store(false, std::memory_order_relaxed);
  history_.add(state.stamp, state.state);

  StateSample& sample = states_.slot();
  sample.sequence = state.sequence;
  sample.stamp = state.stamp;
  sample.received = now;
  sample.state = state.state;
  sample.state.q_WB.normalize();
  sample.thrust_known = state.thrust_known;
  sample.round_trip = state.round_trip;
  sample.depth_sequence = state.depth_sequence;
  sample.heard_waypoint = state.heard_waypoint;
  sample.heard_lap = state.heard_lap;
  states_.publish();
  frame_named_.store(std::max(state.depth_sequence, frame_named_.load(std::memory_order_relaxed)),
                     std::memory_order_release);
  return Intake::kTaken;
}

Status Session::check(const protocol::DepthFrame& frame) const {
  if (frame.session != id_)
    return Error{"session is " + std::to_string(frame.session) + ", expected " + std::to_string(id_)};
  if (auto s = protocol::validate(frame, request_.camera); !s) return s;
  if (frame.sequence <= last_frame_sequence_)
    return Error{"sequence is " + std::to_string(frame.sequence) + ", expected more than " +
                 std::to_string(last_frame_sequence_) + " (frames must rise)"};
  if (last_frame_sequence_ != 0 && frame.stamp <= last_frame_stamp_)
    return Error{"stamp is " + std::to_string(frame.stamp.count()) + " ns, expected later than " +
                 std::to_string(last_frame_stamp_.count()) + " ns (time went backwards)"};
  return {};
}

Session::Intake Session::take_depth(protocol::DepthFrame& frame) {
  const std::lock_guard lock(frames_mutex_);
  frames_received_.fetch_add(1, std::memory_order_relaxed);
  if (frame.session == id_ && frame.sequence == last_frame_sequence_ && frame.sequence != 0 &&
      frame.stamp == last_frame_stamp_)
    return Intake::kRepeated;
  if (const Status status = check(frame); !status) {
    frames_rejected_.fetch_add(1, std::memory_order_relaxed);
    if (frame.session == id_ && frame.sequence > last_frame_sequence_)
      frame_refused_.store(frame.sequence, std::memory_order_release);
    note("depth: " + status.error());
    return Intake::kRejected;
  }
  last_frame_sequence_ = frame.sequence;
  last_frame_stamp_ = frame.stamp;
  DepthSample& sample = frames_.slot();
  sample.sequence = frame.sequence;
  sample.stamp = frame.stamp;
  sample.encoding = frame.encoding;
  sample.pixels.swap(frame.pixels);
  frames_.publish();
  frame_arrived_.store(frame.sequence, std::memory_order_release);
  return Intake::kTaken;
}

void Session::note_rejected_state(const std::string& reason) {
  states_received_.fetch_add(1, std::memory_order_relaxed);
  states_rejected_.fetch_add(1, std::memory_order_relaxed);
  newest_state_rejected_.store(true, std::memory_order_relaxed);
  note("state: " + reason);
}

void Session::note_rejected_frame(const std::string& reason) {
  frames_received_.fetch_add(1, std::memory_order_relaxed);
  frames_rejected_.fetch_add(1, std::memory_order_relaxed);
  note("depth: " + reason);
}

void Session::note(const std::string& reason) {
  const std::lock_guard lock(reason_mutex_);
  last_reason_.assign(reason, 0, protocol::kMaxReasonLength);
  ++unlogged_;
}

// ---- perception side ------------------------------------------------------------------------------------------------

bool Session::frame_due() const noexcept {
  if (!frames_.fresh()) return false;
  if (!lockstep()) return true;
  const std::uint64_t named = frame_named_.load(std::memory_order_acquire);
  return named > frame_processed_.load(std::memory_order_relaxed) &&
         frame_arrived_.load(std::memory_order_acquire) >= named;
}

bool Session::perceive(perception::DepthEncoder& encoder) noexcept {
  const DepthSample* const frame = frames_.read();
  if (!frame) return false;
  const Stamp begin = clock_->now();
  const std::uint64_t packed = target_.load(std::memory_order_acquire);
  const auto target = static_cast<std::uint32_t>(packed);
  const auto next = static_cast<std::uint32_t>(packed >> 32);
  try {
    Eigen::Isometry3d X_WB;
    std::chrono::nanoseconds off{0};
    const char* wrong = nullptr;
    switch (history_.pose_at(frame->stamp, &X_WB, &off)) {
      case StateHistory::Found::kYes:
        break;
      case StateHistory::Found::kEmpty:
        wrong = "no state came yet, so its pose is not known";
        break;
      case StateHistory::Found::kTooOld:
        wrong = "captured before the oldest state that is kept";
        break;
      case StateHistory::Found::kTooNew:
        wrong = "captured more than 30 ms after the newest state";
        break;
      case StateHistory::Found::kGap:
        wrong = "captured in a gap between states";
        break;
    }
    if (wrong) {
      frames_rejected_.fetch_add(1, std::memory_order_relaxed);
      note("depth: frame " + std::to_string(frame->sequence) + " was " + wrong + " (by " + milliseconds_text(off) +
           ")");
    } else {
      switch (sight_.look(frame->pixels, frame->encoding, frame->stamp, X_WB, target, next, encoder)) {
        case Sight::Outcome::kLooked:
          good_frame_stamp_.store(frame->stamp.count(), std::memory_order_relaxed);
          break;
        case Sight::Outcome::kEmpty:
          frames_invalid_.fetch_add(1, std::memory_order_relaxed);
          note("depth: frame " + std::to_string(frame->sequence) +
               " has no return in any pixel, expected some between min_depth_m and max_depth_m");
          break;
        case Sight::Outcome::kSaturated:
          frames_invalid_.fetch_add(1, std::memory_order_relaxed);
          note("depth: frame " + std::to_string(frame->sequence) +
               " is saturated, expected some pixels between min_depth_m and max_depth_m");
          break;
      }
    }
    perception::MemorySnapshot& snapshot = memories_.slot();
    sight_.memory().snapshot(target, next, &snapshot);
    snapshot.frame = frame->sequence;
    snapshot.target = target;
    memories_.publish();
  } catch (const std::exception& e) {
    frames_rejected_.fetch_add(1, std::memory_order_relaxed);
    note("depth: frame " + std::to_string(frame->sequence) + " could not be encoded: " + e.what());
  }
  encode_time_ns_.store((clock_->now() - begin).count(), std::memory_order_relaxed);
  frame_processed_.store(frame->sequence, std::memory_order_release);
  return true;
}

// ---- control side ---------------------------------------------------------------------------------------------------

const perception::RememberedGate* Session::remembered(std::uint32_t waypoint) const noexcept {
  if (!memory_) return nullptr;
  const std::size_t count = request_.course.waypoints.size();
  const perception::RememberedGate* gate = nullptr;
  if (memory_->target == waypoint)
    gate = &memory_->gates[0];
  else if ((memory_->target + 1) % count == waypoint)
    gate = &memory_->gates[1];
  return gate && gate->seen ? gate : nullptr;
}

planner::GateBelief Session::belief(std::uint32_t waypoint) const noexcept {
  const perception::RememberedGate* const gate = remembered(waypoint);
  if (!gate) return progress_.nominal(waypoint);
  planner::GateBelief belief;
  belief.center_W = gate->center_W;
  belief.axis_W = gate->axis_W;
  belief.seen = true;
  belief.center_sigma_m = gate->center_sigma_m;
  belief.axis_sigma_rad = gate->axis_sigma_rad;
  belief.field = &gate->field;
  return belief;
}

planner::GateBelief Session::planned_gate(std::uint32_t waypoint) const noexcept {
  planner::GateBelief gate = belief(waypoint);
  if (!planner_->profile().waypoint_from_field) gate.center_W = progress_.nominal(waypoint).center_W;
  return gate;
}

double Session::age_of(std::uint32_t waypoint, Stamp at) const noexcept {
  const perception::RememberedGate* const gate = remembered(waypoint);
  return gate ? std::max(0.0, seconds(at - gate->stamp)) : -1.0;
}

void Session::publish_target() noexcept {
  target_.store(pack(progress_.target(), progress_.next()), std::memory_order_release);
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
  const planner::GateBelief target = belief(progress_.target());
  if (progress_.update(sample.state.p_WB, target)) {
    leave(target);
    publish_target();
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
  if (const perception::MemorySnapshot* const memory = memories_.read()) memory_ = memory;
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
  input.left = left_;
  input.has_left = have_left_;
  const planner::GateBelief before = belief(ahead_.target());
  if (ahead_.update(input.start.p_WB, before)) {
    input.left = before;
    input.left.field = nullptr;
    input.has_left = true;
  }

  input.elapsed_s = have_plan_ ? std::max(0.0, seconds(plan_start - last_plan_start_)) : 0.0;
  input.step = steps_made_++;
  input.target = planned_gate(ahead_.target());
  input.stamp = plan_start;
  input.waypoint = ahead_.target();
  input.has_next = ahead_.has_next();
  input.next = planned_gate(ahead_.next());
  const double field_age_s = age_of(ahead_.target(), plan_start);
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

  const Withheld withheld = fill_command(plan_start, plan_);
  command_good_ = withheld == Withheld::kNothing;
  if (!command_good_) {
    // The client goes on along the plan that it has; what led here must not come back by the warm start.
    planner_->reset();
    have_plan_ = false;
    withheld_.store(static_cast<int>(withheld), std::memory_order_relaxed);
    commands_withheld_.fetch_add(1, std::memory_order_relaxed);
    return {};
  }
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

Session::Withheld Session::fill_command(Stamp plan_start, const planner::Plan& plan) noexcept {
  const QuadrotorModel& model = request_.quadrotor;
  const int steps = std::min(plan.steps, protocol::kMaxPlanSteps);
  if (steps < 1) return Withheld::kNotFinite;
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    const ThrustRates& rates = plan.thrust_rate_n_s[k];
    const QuadrotorState& state = plan.state[k];
    if (!rates.allFinite() || !state.thrust_command_n.allFinite() || !state.w_WB_B.allFinite())
      return Withheld::kNotFinite;
    if (rates.cwiseAbs().maxCoeff() > model.thrust_rate_max_n_s + kLimitSlack) return Withheld::kRateLimit;
    if (state.thrust_command_n.minCoeff() < model.thrust_min_n - kLimitSlack ||
        state.thrust_command_n.maxCoeff() > model.thrust_max_n + kLimitSlack)
      return Withheld::kThrustLimit;
    if (!(state.w_WB_B.norm() < kMostBodyRate_rad_s)) return Withheld::kBodyRate;
  }
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
  return Withheld::kNothing;
}

void Session::sent(Stamp now, bool ok) noexcept {
  if (!ok) {
    commands_lost_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  commands_sent_.fetch_add(1, std::memory_order_relaxed);
  if (first_answer_) delay_.residence(std::max(now - newest_.received, std::chrono::nanoseconds{0}));
  first_answer_ = false;
}

// ---- for people -----------------------------------------------------------------------------------------------------

void Session::fill(Stamp now, protocol::Telemetry* telemetry) {
  if (const protocol::PlannerHealth* const health = healths_.read()) last_health_ = *health;
  telemetry->vehicle = request_.vehicle;
  telemetry->session = id_;
  telemetry->server_stamp = now;
  telemetry->health = last_health_;
  telemetry->states_received = states_received_.load(std::memory_order_relaxed);
  telemetry->states_rejected = states_rejected_.load(std::memory_order_relaxed);
  telemetry->frames_received = frames_received_.load(std::memory_order_relaxed);
  telemetry->frames_rejected = frames_rejected_.load(std::memory_order_relaxed);
  telemetry->frames_invalid = frames_invalid_.load(std::memory_order_relaxed);
  telemetry->commands_sent = commands_sent_.load(std::memory_order_relaxed);
  telemetry->deadlines_missed = deadlines_missed_.load(std::memory_order_relaxed);
  telemetry->encode_time_s = 1e-9 * static_cast<double>(encode_time_ns_.load(std::memory_order_relaxed));
  telemetry->isa = isa_.substr(0, 15);
  const std::lock_guard lock(reason_mutex_);
  telemetry->last_reason = last_reason_;
}

std::optional<std::string> Session::rejections() {
  const std::lock_guard lock(reason_mutex_);
  std::string text;
  if (unlogged_ > 0)
    text = std::to_string(unlogged_) + (unlogged_ == 1 ? " complaint" : " complaints") + ", the last: " + last_reason_;
  unlogged_ = 0;
  if (const std::uint64_t withheld = commands_withheld_.load(std::memory_order_relaxed); withheld != withheld_logged_) {
    const char* const why = sentence(withheld_.load(std::memory_order_relaxed));
    if (!text.empty()) text += "; ";
    text += std::to_string(withheld - withheld_logged_) + " times " + why;
    last_reason_ = why;
    withheld_logged_ = withheld;
  }
  if (text.empty()) return std::nullopt;
  return text;
}

}  // namespace gatefield::service
