#pragma once

#include <atomic>
#include <cstdint>

#include "client/flight/clock.h"
#include "client/flight/ports.h"

namespace gatefield::flight {

struct LoopOptions {
  double state_rate_hz = 200.0;  ///< how often the newest state is sent; rounded to whole periods, at least one
  /// A step that begins more than this after its time is counted as late.
  Stamp late_tolerance = std::chrono::milliseconds(1);
  /// Up to this much behind, the loop catches up: the steps that are due follow each other at once. Farther behind, the
  /// time is given up and the following steps are due that much later. What is simulated must not skip time and allows
  /// much; of a vehicle whose time goes on by itself one period is right.
  Stamp slip_after = std::chrono::milliseconds(250);
  /// This long without a plan the flight is given up.
  Stamp give_up = std::chrono::seconds(30);
};

/// Says which field is wrong and why: state rate 10 to 1000 Hz, tolerances from zero, give_up more than zero.
Status validate(const LoopOptions& options);

class Supervision;

struct Ports {
  StateSource* states = nullptr;
  DepthSource* depth = nullptr;  ///< null: no camera
  Actuator* actuator = nullptr;
  Observer* observer = nullptr;            ///< null: nobody watches
  FlightController* controller = nullptr;  ///< null: nothing to arm, the vehicle is not supervised
  Supervision* supervision = nullptr;      ///< with a controller
};

enum class End {
  kOver,     ///< the observer said so
  kGivenUp,  ///< no plan for LoopOptions::give_up
  kKilled,   ///< the supervisor had the motors stopped
  kStopped,  ///< the stop flag
};

/// How a flight went, as the loop saw it.
struct LoopStatistics {
  End end = End::kStopped;
  std::uint64_t steps = 0;
  std::uint64_t late_steps = 0;
  Stamp worst_late{0};
  Stamp slipped{0};                   ///< time given up on, see LoopOptions::slip_after
  Stamp flown{0};                     ///< time during which setpoints were applied
  Stamp on_fallback{0};               ///< of that, not by a plan
  std::uint64_t control_periods = 0;  ///< of the session, since the first plan
  std::uint64_t periods_without_plan = 0;
  std::uint64_t states_sent = 0;
  std::uint64_t frames_sent = 0;
};

/// Flies a vehicle as a client of a planning server, in real time, until it ends; on the calling thread.
///
/// Steps are due at absolute times, one period of the actuator apart, so that lateness does not add up; a step's `now`
/// is the time it is due at. In each step: the newest state is taken; sent, when one is due and it is newer than the
/// last one sent; new plans are heard; what the client plays for `now` is applied. Until the first plan is there the
/// vehicle is held. Frames are captured and sent by a thread of their own, which has ended when this returns.
///
/// After the end nothing is applied any more: who owns the motors sees to what comes then.
///
/// With a flight controller the vehicle is supervised: what is applied is what the supervision makes of the plan, and
/// the controller is told what is wanted of it each step. Whatever would end the loop (stop, the observer, no plan for
/// too long) asks the supervisor to land, and the loop ends when the motors are off, the vehicle is killed, or somebody
/// else flies it. A kill is told for a second, or until the controller is disarmed.
///
/// Real-time safe: the loop allocates nothing, takes no lock and waits for nothing but its next step; what the client's
/// send_state() and newest() do is the client's affair.
/// @pre states and actuator are set, supervision is where controller is, validate(options), and the client has joined a
///      session
/// @param stop  true: the loop ends within a period
LoopStatistics run_loop(const Ports& ports, sdk::Client* client, const LoopOptions& options, LoopClock* clock,
                        const std::atomic<bool>& stop);

}  // namespace gatefield::flight
