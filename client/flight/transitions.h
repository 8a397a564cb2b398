#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "client/flight/ports.h"

/// The supervisor's states and what leads from one to another, as one table. The supervisor obeys it, docs/safety.md
/// and its picture are made of it, and the tests walk through every line of it.
/// Thread-safe: yes (constants).   Real-time safe: yes.
namespace gatefield::flight {

/// What the supervisor is in.
enum class Phase : std::uint8_t {
  kDisarmed,      ///< on the ground; a check fails
  kReady,         ///< on the ground; all checks pass, the motors wait for the person
  kArming,        ///< the flight controller is asked to arm and to follow
  kTakeOff,       ///< climbs
  kHolding,       ///< hovers in its place
  kHandOver,      ///< from hovering over to the plan
  kRacing,        ///< flies the plan
  kBraking,       ///< levels out and stops
  kDescending,    ///< sinks, by state
  kLevelDescent,  ///< level and a little too little thrust, by time: there is no state
  kYielded,       ///< somebody else flies: the person, or the firmware's own failsafe
  kLanded,        ///< on the ground; the flight controller is asked to disarm
  kKilled,        ///< motors off, whatever comes; a person resets it
};
inline constexpr std::size_t kPhases = 13;

/// What leads from one phase to another. What for counts as long as it says is in SupervisorOptions.
enum class Cause : std::uint8_t {
  kKillAsked,         ///< the kill switch, or who runs the program
  kArmSwitchOff,      ///< the arm switch went off
  kTakenOver,         ///< the person took over, or the controller follows somebody else
  kFirmwareFailsafe,  ///< the firmware's own failsafe flies
  kMotorsOff,         ///< the controller says that it is disarmed
  kStateLost,         ///< no good state for too long
  kStateWrong,        ///< states contradict each other, as the server says
  kFenceBroken,       ///< outside of the fence, or about to be
  kBatteryLow,        ///< below the voltage to land at
  kControllerSilent,  ///< nothing heard of the flight controller
  kPilotSilent,       ///< the person's radio is not heard
  kStopAsked,         ///< who runs the program wants it down
  kRaceOver,          ///< the course is done
  kPlanLost,          ///< no plan covers this moment
  kPlanBack,          ///< a plan is there again after a short outage
  kPlanSteady,        ///< plans have come for long enough
  kHandedOver,        ///< the plan has the vehicle
  kStopped,           ///< slow and level
  kBrakeTimeOver,     ///< it should have stopped by now
  kHoldTimeOver,      ///< hovering has an end
  kHeightReached,     ///< of the take-off
  kTakeOffTimeOver,   ///< it should have been up by now
  kTouchedDown,       ///< on the ground
  kDescentTimeOver,   ///< it should have been down by now
  kStateBack,         ///< good states for long enough
  kLevelTimeOver,     ///< the level descent has lasted its time
  kGivenBack,         ///< the person gave the vehicle back in the air
  kArmedByOthers,     ///< armed, and nobody asked us
  kChecksPass,        ///< all of them
  kCheckFailed,       ///< at least one
  kArmAsked,          ///< the arm switch went on, or the option that stands for it
  kArmed,             ///< armed and following
  kArmingTimeOver,    ///< it did not arm in time
  kDisarmTimeOver,    ///< it did not disarm in time
  kReset,             ///< switches are back and the motors are off
};
inline constexpr std::size_t kCauses = 35;

using PhaseSet = std::uint16_t;  ///< bit by number
constexpr PhaseSet set(Phase phase) noexcept { return static_cast<PhaseSet>(1u << static_cast<unsigned>(phase)); }
constexpr PhaseSet operator|(PhaseSet phases, Phase phase) noexcept {
  return static_cast<PhaseSet>(phases | set(phase));
}
constexpr PhaseSet operator|(Phase a, Phase b) noexcept { return set(a) | b; }
constexpr bool contains(PhaseSet phases, Phase phase) noexcept { return (phases & set(phase)) != 0; }

/// What goes on towards the race and is stopped by whatever forbids that,
inline constexpr PhaseSet kOnward = Phase::kTakeOff | Phase::kHandOver | Phase::kRacing;
/// all that flies by a state,
inline constexpr PhaseSet kByState = kOnward | Phase::kHolding | Phase::kBraking | Phase::kDescending;
/// all in which the vehicle is in the air and obeys us,
inline constexpr PhaseSet kInTheAir = kByState | Phase::kLevelDescent;
/// and all from which it can be killed.
inline constexpr PhaseSet kAlive =
    kInTheAir | Phase::kDisarmed | Phase::kReady | Phase::kArming | Phase::kYielded | Phase::kLanded;

/// From each of these phases, when the cause is there, to that one.
struct Transition {
  PhaseSet from;
  Cause cause;
  Phase to;
};

/// All of them, the more urgent first: of the lines that fit, the first one counts.
std::span<const Transition> transitions() noexcept;

/// "hand_over": for logs and programs.
std::string_view name(Phase phase) noexcept;
/// What the vehicle does, for people.
std::string_view sentence(Phase phase) noexcept;
/// What is wanted of the flight controller meanwhile.
Wanted wanted(Phase phase) noexcept;

/// "plan_lost"
std::string_view name(Cause cause) noexcept;
/// What has happened, for people, and what to look at where something went wrong.
std::string_view sentence(Cause cause) noexcept;

}  // namespace gatefield::flight
