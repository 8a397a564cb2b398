#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "client/simulator/firmware_in_loop.h"
#include "client/simulator/px4_in_loop.h"
#include "client/simulator/run_log.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// When a race in lockstep begins: simulated clocks do not start at zero, so that a link delay has a past to look into.
inline constexpr Stamp kLockstepEpoch = std::chrono::seconds(10);

struct Options {
  protocol::Timing timing = protocol::Timing::kLockstep;
  /// Lockstep: states and frames reach the planner this much later, as over a slow link; its answers then come as late.
  Stamp link_delay{0};
  /// Lockstep: on top of the delay each state (with its answer) and each frame is late by as much as this, uniform.
  /// What a newer one of its kind has overtaken is lost.
  Stamp link_jitter{0};
  /// Lockstep: probability that a message is lost: a state on its way there, its answer on the way back, a frame.
  double link_loss = 0.0;
  /// Lockstep: for so long nothing gets through, beginning when the seed says (SimulatedLink::outage_begin()).
  Stamp link_outage{0};
  /// Real time: how often the state is sent, 10 to 1000 Hz (rounded to whole milliseconds).
  double state_rate_hz = 200.0;
  bool depth_in_counts = true;  ///< 16 bits, of the camera's metres_per_count; else 32-bit metres
  /// Lockstep: how long (wall clock) to wait for an answer before flying on along the last plan.
  std::chrono::milliseconds answer_timeout{2000};
  /// Wall clock without any plan after which the race is given up, from when a firmware hovers.
  std::chrono::milliseconds give_up{30000};
  /// A firmware that flies the vehicle in place of the simulator's own rate loop.
  /// Lockstep is only for one with the clock library (client/firmware/betaflight_sitl/packets.h).
  std::optional<FirmwareOptions> firmware;
  /// PX4 flies the vehicle in place of the simulator's own rate loop: its SITL in lockstep, a board on a serial port in
  /// real time. Not together with `firmware`.
  std::optional<Px4Options> px4;
};

/// How the race stands, for a progress line.
struct Progress {
  double race_time_s = 0.0;
  int lap = 0;
  int laps = 0;
  int gate = 0;   ///< expected next, index of the waypoint
  int gates = 0;  ///< per lap
  double speed_m_s = 0.0;
};
using ProgressFunction = std::function<void(const Progress&)>;

using ProblemFunction = std::function<void(const HeardProblem&)>;
using SessionFunction = std::function<void(const HeardSession&)>;

/// Says which option is wrong, or which make no sense together. Errors: kInvalid with the field ("link_delay").
Status validate(const Options& options);

/// Flies one race of the scenario with `client`, which has joined a session already, and tells how it went.
///
/// Lockstep: simulated time. Per control period of the session: the depth frames that are due, the state, then the
/// answer is waited for, then 1 ms steps of play() and the plant until the next period. Same scenario and seed and same
/// answers: same race.
///
/// Real time: the plant runs at 1x on the calling thread against the monotonic clock, in the loop of any vehicle
/// (client/flight/loop.h); frames are rendered and sent by a second thread, so that a slow image never holds up the
/// plant. The vehicle is held at the start until the first plan arrives; then the race's clock starts.
///
/// With a firmware it is found and armed first, while the vehicle is held; the first state is sent when it hovers. When
/// it stops flying in mid-race, the race ends as kFlightControllerLost, and the report says why. PX4's time is the
/// race's in lockstep, but setpoints reach it over links of the real world: such a race is not the same bit for bit
/// every time.
///
/// @param stop  becomes true when a person ends the race; it then ends within 0.3 s as kInterrupted.
/// @param on_progress  may be empty; about ten times a second, never on the plant's thread in real time.
/// @param on_problem   may be empty; each problem when it is heard of for the first time (in lockstep after the answer
///                     that tells it, in real time within 0.1 s), on the thread that on_progress is called on, or after
///                     the race on the calling one.
/// @param on_session   may be empty; what becomes of the session, at the same times.
/// Errors: a world that the physics refuses; a firmware that is not there, does not fit the vehicle (those of
/// FirmwareInLoop::open() and Px4InLoop::open()) or does not arm. A lost race is not an error.
/// Thread-safe: yes, for different clients.
Result<Report> fly(const config::Scenario& scenario, const Options& options, sdk::Client* client,
                   const std::atomic<bool>& stop, const ProgressFunction& on_progress = {},
                   const ProblemFunction& on_problem = {}, const SessionFunction& on_session = {});

/// How a scenario's vehicle joins its session: vehicle, camera, course and the planner's seed. Who joins says the rest:
/// domain, names, profile, speed and times.
sdk::Options session_options(const config::Scenario& scenario, protocol::Timing timing);

/// Where the vehicle of a scenario begins: hovering at the start of its course.
QuadrotorState start_state(const config::Scenario& scenario);

}  // namespace gatefield::simulator
