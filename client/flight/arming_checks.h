#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "client/flight/ports.h"
#include "client/flight/supervisor_options.h"
#include "common/protocol/problems.h"

namespace gatefield::flight {

/// What the supervisor is told each step.
struct Observation {
  std::optional<TimedState> state;  ///< the newest one, also when it is an old one
  bool plan_valid = false;          ///< a plan covers this moment
  std::optional<Stamp> round_trip;  ///< state out to plan in, of the newest plan; empty: none came within a second
  bool field_seen = false;          ///< that plan flies by a gate's field
  protocol::Problems problems = 0;  ///< what the server says is wrong
  bool race_over = false;           ///< the course is done
  bool stop_asked = false;          ///< who runs the program wants the vehicle down
  bool kill_asked = false;          ///< or its motors off, now
  std::optional<ControllerStatus> controller;
};

/// What is looked at before arming.
enum class Check : std::uint8_t {
  kControllerHeard,   ///< the flight controller's word is fresh
  kPilotHeard,        ///< so is the person's radio
  kArmSwitchOff,      ///< the arm switch was off once before it goes on
  kNotTakenOver,      ///< the person neither flies by hand nor has killed
  kFirmwareFailsafe,  ///< the firmware's own failsafe is set up
  kBattery,           ///< full enough
  kStateFresh,        ///< good states have come for a while
  kStill,             ///< the vehicle stands, level
  kInsideFence,       ///< and where it may fly
  kServerAnswers,     ///< plans come
  kRoundTrip,         ///< soon enough
  kFieldSeen,         ///< and by a gate that was seen
  kServerContent,     ///< the server finds nothing wrong that would be flown by
  kFlightWanted,      ///< nobody wants it down already
  kAttitudesAgree,    ///< the states' roll and pitch are the flight controller's own
};
inline constexpr int kChecks = 15;
using Checks = std::uint32_t;  ///< a set of them: bit by number
constexpr Checks bit(Check check) noexcept { return Checks{1} << static_cast<unsigned>(check); }

/// What contradicts itself so that it can't be flown by, and what else keeps a vehicle on the ground.
inline constexpr protocol::Problems kStateContradictions =
    protocol::bit(protocol::Problem::kVelocityAgainstMotion) | protocol::bit(protocol::Problem::kRatesAgainstAttitude);
inline constexpr protocol::Problems kKeepsOnTheGround =
    kStateContradictions | protocol::bit(protocol::Problem::kMountingLooksWrong) |
    protocol::bit(protocol::Problem::kDepthUnitLooksWrong) | protocol::bit(protocol::Problem::kStampsJump) |
    protocol::bit(protocol::Problem::kDepthMissing) | protocol::bit(protocol::Problem::kStatesMissing) |
    protocol::bit(protocol::Problem::kStatesRejected) | protocol::bit(protocol::Problem::kFramesRejected) |
    protocol::bit(protocol::Problem::kDelayLong);
/// The same for these options: who has no camera misses no depth.
constexpr protocol::Problems keeps_on_the_ground(const SupervisorOptions& options) noexcept {
  return options.needs_depth ? kKeepsOnTheGround : kKeepsOnTheGround & ~protocol::bit(protocol::Problem::kDepthMissing);
}

/// What the supervisor remembers that checks need.
struct CheckMemory {
  bool controller_fresh = false, pilot_fresh = false, switch_was_off = false, state_settled = false;
  bool attitudes_agree = true;
};

/// How far the state and the flight controller's own attitude are apart in roll and pitch: the angle between the
/// directions that each takes for up, in the body's axes. The heading, which may count from anywhere, is left out.
/// Empty: one of the two is not known.
std::optional<double> tilt_apart_rad(const Observation& observation) noexcept;

/// Those that fail.
Checks failing(const Observation& observation, const CheckMemory& memory, const SupervisorOptions& options) noexcept;

/// Machine-readable name, e.g. "round_trip".
std::string_view name(Check check) noexcept;
/// Why it fails, as code, field, value and expectation, with the next step in the sentence. Not real-time safe.
/// @pre it fails
Error explain(Check check, const Observation& observation, const SupervisorOptions& options);
/// Those in the set, by number.
std::vector<Check> list(Checks checks);

}  // namespace gatefield::flight
