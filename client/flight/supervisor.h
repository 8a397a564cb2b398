#pragma once

#include <bitset>
#include <optional>

#include "client/flight/arming_checks.h"
#include "client/flight/held.h"
#include "client/flight/state_check.h"
#include "client/flight/supervisor_options.h"
#include "client/flight/transitions.h"

namespace gatefield::flight {

/// What the supervisor says each step.
struct Directive {
  Phase phase = Phase::kDisarmed;
  Cause cause = Cause::kReset;  ///< what led into it; at the beginning kReset
  Phase from = Phase::kDisarmed;
  Stamp since{0};      ///< when
  Checks failing = 0;  ///< before arming: the checks that fail now; else those that failed last
};

/// Decides what a vehicle may do: whether it may arm, who flies, and how a flight ends when something is missing.
///
/// It is a state machine over Phase that walks along the lines of transitions(), at most one line a step. What a phase
/// means for motors and setpoints is Manoeuvres' affair. It knows no clock, thread, log or transport: what it is told
/// is an Observation, and time is an argument, so tests walk it through every line in milliseconds.
///
/// What always holds:
///   - It asks for turning motors only after a person's switch went from off to on (or ArmBy::kItself) with all checks
///     passing, and after a person gave a flying vehicle back.
///   - Kill, arm switch and take-over come before everything else, in every phase.
///   - Each phase in the air has an end of its own, whatever is or is not heard: nothing keeps a last setpoint for
///     ever. (Racing ends with the plan, which the client's plan player ends.)
///   - What ends a flight for good (fence, battery, stop, end of the race, a silent controller or pilot) stays until
///     the vehicle is disarmed, though what is missing may come back.
///
/// Thread-safe: no.   Real-time safe: yes.   Errors: none.
class Supervisor {
 public:
  /// @pre validate(options)
  explicit Supervisor(const SupervisorOptions& options) noexcept : options_(options), state_(options.state) {}

  /// One step. @param now  does not fall
  const Directive& update(Stamp now, const Observation& observation) noexcept;

  const Directive& directive() const noexcept { return directive_; }
  /// What is wanted of the flight controller: what the phase says (flight::wanted()). One that is armed while we stand
  /// on the ground is asked for nothing, though: a person's switch arms many of them by itself, and the word of that
  /// may come before the switch's own.
  Wanted wanted() const noexcept;
  /// The newest state that can be flown by, however old: what the law of the next step takes.
  const std::optional<TimedState>& state() const noexcept { return state_.newest(); }
  /// Height of the ground, as it was when the vehicle armed; empty: not known.
  std::optional<double> ground_z_m() const noexcept { return ground_z_m_; }
  /// What is there now, by Cause; for records and tests.
  bool there(Cause cause) const noexcept { return facts_[static_cast<std::size_t>(cause)]; }

 private:
  using Facts = std::bitset<kCauses>;

  void listen(Stamp now, const Observation& observation) noexcept;
  Facts facts(Stamp now, const Observation& observation) const noexcept;
  Facts ends_of_flight(Stamp now, const Observation& observation) const noexcept;
  PilotSwitches switches() const noexcept;
  Checks failing_checks(Stamp now, const Observation& observation) const noexcept;
  Stamp time_to_the_ground() const noexcept;
  bool touched_down(Stamp now) const noexcept;
  bool standing() const noexcept { return is(Phase::kDisarmed) || is(Phase::kReady); }
  bool switch_unheard_since_arming() const noexcept;
  bool in_phase_for(Stamp now, Stamp span) const noexcept { return now - directive_.since >= span; }
  bool is(Phase phase) const noexcept { return directive_.phase == phase; }
  bool flying() const noexcept { return contains(kInTheAir, directive_.phase); }
  double height_m() const noexcept;
  void enter(Stamp now, const Transition& transition) noexcept;

  SupervisorOptions options_;
  Directive directive_;
  StateCheck state_;
  Facts facts_;
  Facts for_good_;  // what ends this flight, until disarmed

  // What was heard, and for how long.
  std::optional<ControllerStatus> controller_;  // while it is fresh
  Held tilts_apart_, not_following_, motors_off_, controller_silent_, pilot_silent_, battery_low_, contradicting_,
      agreeing_, planned_, slow_, resting_, armed_unasked_, on_ground_, free_;
  std::optional<Stamp> armed_at_;  // the controller's first word of it
  bool switch_was_off_ = false;    // since the last arming
  bool armed_itself_ = false;      // ArmBy::kItself does so once
  bool attitudes_agree_ = true;    // on the ground; once they did not, never again
  bool was_yielded_ = false;       // in kYielded: somebody did fly
  Stamp level_for_{0};             // how long kLevelDescent lasts
  std::optional<double> ground_z_m_;
};

/// Why the newest transition happened, with what was measured and what is expected where that says more. Not real-time
/// safe.
std::string explain(const Directive& directive, const Observation& observation, const SupervisorOptions& options);

}  // namespace gatefield::flight
