#include "client/flight/loop.h"

#include <algorithm>
#include <cmath>

#include "client/flight/depth_sender.h"
#include "client/flight/plan_watch.h"
#include "client/flight/supervision.h"
#include "common/base/text.h"

namespace gatefield::flight {
namespace {

class Loop {
 public:
  Loop(const Ports& ports, sdk::Client* client, const LoopOptions& options, LoopClock* clock,
       const std::atomic<bool>& stop)
      : ports_(ports),
        client_(*client),
        options_(options),
        clock_(*clock),
        stop_(stop),
        period_(ports.actuator->period()),
        state_period_(period_ *
                      std::max<std::int64_t>(1, std::llround(1.0 / (options.state_rate_hz * seconds(period_))))),
        plans_(std::max(period_, from_seconds(client->session().control_period_s))) {}

  LoopStatistics run() {
    DepthSender frames(ports_.depth, &client_);
    begin_ = clock_.now();
    for (Stamp elapsed{0}; !ended_; elapsed += period_) step(elapsed);
    const PlanWatch::Count plans = plans_.count(clock_.now());
    statistics_.control_periods = plans.periods;
    statistics_.periods_without_plan = plans.without_plan;
    statistics_.frames_sent = frames.stop();
    return statistics_;
  }

 private:
  void step(Stamp elapsed) {
    const Stamp now = begin_ + statistics_.slipped + elapsed;
    const Stamp woke = clock_.sleep_until(now);
    note_lateness(woke - now);

    const auto state = newest_state(now);
    if (state) send_if_due(elapsed, *state);
    hear_plans();
    if (ports_.controller != nullptr) {
      supervise(now, state);
    } else if (state && plans_.heard_any()) {
      apply(now, client_.play(now, state->state, period_));
    } else {
      ports_.actuator->hold(now);
    }

    const Stamp silent_since = plans_.heard_any() ? plans_.newest() : begin_;
    if (ports_.observer != nullptr && !ports_.observer->goes_on()) {
      wants_end(End::kOver);
    } else if (woke - silent_since > options_.give_up) {
      wants_end(End::kGivenUp);
    } else if (stop_) {
      wants_end(End::kStopped);
    }
    ended_ = why_ && (ports_.controller == nullptr || down(now));
  }

  void supervise(Stamp now, const std::optional<TimedState>& state) noexcept {
    sdk::Setpoint plan;
    if (state && plans_.heard_any()) plan = client_.play(now, state->state, period_);
    observation_.state = state;
    observation_.plan_valid = plan.source == sdk::Setpoint::Source::kPlan;
    if (!plans_.heard_any() || now - plans_.newest() > std::chrono::seconds(1)) observation_.round_trip.reset();
    observation_.problems = client_.problems();
    observation_.stop_asked = why_.has_value();
    observation_.controller = ports_.controller->newest(now);

    const Stamp phase_since = ports_.supervision->directive().since;
    const auto setpoint = ports_.supervision->step(now, observation_, plan);
    const Directive& directive = ports_.supervision->directive();
    if (ports_.observer != nullptr) {
      if (directive.since != phase_since) ports_.observer->on_phase(directive);
      ports_.observer->on_supervised(directive, observation_);
    }
    if (directive.phase == Phase::kKilled) wants_end(End::kKilled);
    ports_.controller->want(now, ports_.supervision->wanted());
    // What the ground carries does not move as it is asked to.
    client_.applied(now, ports_.supervision->off_the_ground() ? setpoint : std::nullopt);
    if (setpoint) {
      apply(now, *setpoint);
    } else {
      ports_.actuator->hold(now);
    }
  }

  // A supervised vehicle may be left alone: its motors are off, or it is in other hands.
  bool down(Stamp now) const noexcept {
    const Directive& directive = ports_.supervision->directive();
    if (directive.phase != Phase::kKilled)
      return !contains(kInTheAir | Phase::kArming | Phase::kLanded, directive.phase);
    const bool off = observation_.controller && !observation_.controller->armed;
    return off || now - directive.since >= std::chrono::seconds(1);
  }

  void note_lateness(Stamp late) noexcept {
    ++statistics_.steps;
    if (late > options_.late_tolerance) ++statistics_.late_steps;
    statistics_.worst_late = std::max(statistics_.worst_late, late);
    if (late > options_.slip_after) statistics_.slipped += late;
  }

  std::optional<TimedState> newest_state(Stamp now) noexcept {
    auto state = ports_.states->newest(now);
    if (state && applied_ && ports_.actuator->accepts() == SetpointPart::kRotorThrusts)
      state->state.thrust_command_n = applied_->rotor_thrust_n;
    return state;
  }

  void send_if_due(Stamp elapsed, const TimedState& state) {
    if (elapsed < next_state_ || (statistics_.states_sent > 0 && state.stamp <= last_sent_)) return;
    client_.send_state(state.stamp, state.state, state.thrust_known);
    ++statistics_.states_sent;
    last_sent_ = state.stamp;
    next_state_ = std::max(next_state_ + state_period_, elapsed);  // who was late owes nothing
  }

  void hear_plans() {
    const Stamp arrival = clock_.now();
    while (const auto plan = client_.newest()) {
      plans_.on_plan(plan->sequence, arrival);
      observation_.round_trip = arrival - plan->answers_stamp;
      observation_.field_seen = plan->health.latent_age_s >= 0;
      observation_.race_over = plan->health.course_done;
      if (ports_.observer != nullptr) ports_.observer->on_plan(*plan);
    }
  }

  void apply(Stamp now, const sdk::Setpoint& setpoint) noexcept {
    applied_ = setpoint;
    if (applied_->source == sdk::Setpoint::Source::kFallback) statistics_.on_fallback += period_;
    statistics_.flown += period_;
    ports_.actuator->apply(now, *applied_);
  }

  void wants_end(End why) noexcept {
    if (!why_) why_ = why;
    statistics_.end = *why_;
  }

  const Ports ports_;
  sdk::Client& client_;
  const LoopOptions options_;
  LoopClock& clock_;
  const std::atomic<bool>& stop_;
  const Stamp period_, state_period_;
  PlanWatch plans_;
  Stamp begin_{0};
  Stamp next_state_{0};  // on the scale of `elapsed`
  Stamp last_sent_{0};
  std::optional<sdk::Setpoint> applied_;
  Observation observation_;  // what a supervised vehicle's supervisor is told
  std::optional<End> why_;   // why the loop is to end
  bool ended_ = false;
  LoopStatistics statistics_;
};

}  // namespace

Status validate(const LoopOptions& options) {
  if (!(options.state_rate_hz >= 10 && options.state_rate_hz <= 1000))
    return Error::invalid("state_rate_hz", text(options.state_rate_hz) + " Hz", "10 to 1000 Hz");
  for (const auto& [field, value] :
       {std::pair("late_tolerance", options.late_tolerance), std::pair("slip_after", options.slip_after)})
    if (value < Stamp{0}) return Error::invalid(field, text(seconds(value)) + " s", "0 or more");
  if (options.give_up <= Stamp{0})
    return Error::invalid("give_up", text(seconds(options.give_up)) + " s", "more than 0");
  return {};
}

LoopStatistics run_loop(const Ports& ports, sdk::Client* client, const LoopOptions& options, LoopClock* clock,
                        const std::atomic<bool>& stop) {
  return Loop(ports, client, options, clock, stop).run();
}

}  // namespace gatefield::flight
