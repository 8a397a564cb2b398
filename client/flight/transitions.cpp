#include "client/flight/transitions.h"

#include <array>

namespace gatefield::flight {
namespace {

using enum Phase;
using C = Cause;

constexpr std::array kTable{
    // A person's word, and the firmware's, before everything else.
    Transition{kAlive, C::kKillAsked, kKilled},
    Transition{kInTheAir, C::kArmSwitchOff, kKilled},
    Transition{set(kArming), C::kArmSwitchOff, kLanded},
    Transition{set(kLanded), C::kMotorsOff, kDisarmed},
    Transition{kInTheAir | kArming | kLanded, C::kTakenOver, kYielded},
    Transition{kInTheAir, C::kFirmwareFailsafe, kYielded},
    Transition{kInTheAir | kYielded, C::kMotorsOff, kLanded},
    // Without a state nothing that needs one goes on.
    Transition{kByState, C::kStateLost, kLevelDescent},
    Transition{kByState, C::kStateWrong, kLevelDescent},
    // What ends the race.
    Transition{kOnward, C::kFenceBroken, kBraking},
    Transition{kOnward, C::kBatteryLow, kBraking},
    Transition{kOnward, C::kControllerSilent, kBraking},
    Transition{kOnward, C::kPilotSilent, kBraking},
    Transition{kOnward, C::kStopAsked, kBraking},
    Transition{kOnward, C::kRaceOver, kBraking},
    Transition{kHandOver | kRacing, C::kPlanLost, kBraking},
    Transition{set(kHolding), C::kFenceBroken, kDescending},
    Transition{set(kHolding), C::kBatteryLow, kDescending},
    Transition{set(kHolding), C::kControllerSilent, kDescending},
    Transition{set(kHolding), C::kPilotSilent, kDescending},
    Transition{set(kHolding), C::kStopAsked, kDescending},
    Transition{set(kHolding), C::kRaceOver, kDescending},
    // Up and into the race.
    Transition{set(kReady), C::kCheckFailed, kDisarmed},
    Transition{set(kReady), C::kArmAsked, kArming},
    Transition{kDisarmed | kReady, C::kArmedByOthers, kYielded},
    Transition{set(kDisarmed), C::kChecksPass, kReady},
    Transition{set(kArming), C::kCheckFailed, kLanded},
    Transition{set(kArming), C::kArmed, kTakeOff},
    Transition{set(kArming), C::kArmingTimeOver, kLanded},
    Transition{set(kTakeOff), C::kHeightReached, kHolding},
    Transition{set(kTakeOff), C::kTakeOffTimeOver, kDescending},
    Transition{kHolding | kDescending, C::kTouchedDown, kLanded},
    Transition{set(kHolding), C::kPlanSteady, kHandOver},
    Transition{set(kHolding), C::kHoldTimeOver, kDescending},
    Transition{set(kHandOver), C::kHandedOver, kRacing},
    // And out of it.
    Transition{set(kBraking), C::kPlanBack, kRacing},
    Transition{set(kBraking), C::kStopped, kHolding},
    Transition{set(kBraking), C::kBrakeTimeOver, kHolding},
    Transition{set(kDescending), C::kPlanSteady, kHolding},
    Transition{set(kDescending), C::kDescentTimeOver, kLevelDescent},
    Transition{set(kLevelDescent), C::kTouchedDown, kLanded},
    Transition{set(kLevelDescent), C::kStateBack, kBraking},
    Transition{set(kLevelDescent), C::kLevelTimeOver, kKilled},
    Transition{set(kYielded), C::kGivenBack, kBraking},
    Transition{set(kLanded), C::kDisarmTimeOver, kKilled},
    Transition{set(kKilled), C::kReset, kDisarmed},
};

struct PhaseText {
  std::string_view name, sentence;
  Wanted wanted;
};
/// In the order of the enumeration.
constexpr std::array<PhaseText, kPhases> kPhaseTexts{{
    {"disarmed", "on the ground, motors off; a check before arming fails", Wanted::kDisarmed},
    {"ready", "on the ground, motors off; all checks pass, the arm switch is waited for", Wanted::kDisarmed},
    {"arming", "the flight controller is asked to arm and to follow us", Wanted::kArmed},
    {"take_off", "climbs straight up to the height of the take-off", Wanted::kArmed},
    {"holding", "hovers in its place, clear of gates", Wanted::kArmed},
    {"hand_over", "goes over from hovering to the plan, little by little", Wanted::kArmed},
    {"racing", "flies the plan", Wanted::kArmed},
    {"braking", "levels out and stops, clear of gates", Wanted::kArmed},
    {"descending", "sinks slowly to the ground, clear of gates", Wanted::kArmed},
    {"level_descent", "stays level with a little less thrust than its weight, by time: there is no state",
     Wanted::kArmed},
    {"yielded", "somebody else flies, the person or the firmware's failsafe; nothing is asked of the controller",
     Wanted::kReleased},
    {"landed", "on the ground; the flight controller is asked to disarm", Wanted::kDisarmed},
    {"killed", "motors off, also in the air, until a person has put the switches back", Wanted::kKilled},
}};

struct CauseText {
  std::string_view name, sentence;
};
constexpr std::array<CauseText, kCauses> kCauseTexts{{
    {"kill_asked", "the kill switch is on, or a kill was asked for"},
    {"arm_switch_off", "the arm switch is off: in the air that stops the motors, as on any racer"},
    {"taken_over", "the person has taken over, or the flight controller left the mode in which it follows us"},
    {"firmware_failsafe",
     "the firmware's own failsafe flies: check its receiver, and whether setpoints reach it often enough"},
    {"motors_off", "the flight controller says that it is disarmed"},
    {"state_lost", "no state that can be flown by: check the source of states, its rate and its stamps"},
    {"state_wrong", "the states contradict each other: check their frame, their order and their time stamps"},
    {"fence_broken", "the vehicle left the fence, or would have"},
    {"battery_low", "the battery is below the voltage to land at"},
    {"controller_silent", "nothing is heard of the flight controller: check the link to it"},
    {"pilot_silent", "the person's radio is not heard: check transmitter and receiver"},
    {"stop_asked", "the program was asked to stop"},
    {"race_over", "the course is done"},
    {"plan_lost", "no plan covers this moment: check the link to the server, and what it says is wrong"},
    {"plan_back", "a plan is there again after a short outage"},
    {"plan_steady", "plans have come without a gap for long enough"},
    {"handed_over", "the plan has the vehicle"},
    {"stopped", "the vehicle is slow and level"},
    {"brake_time_over", "the vehicle should have stopped by now: wind, or states that are off"},
    {"hold_time_over", "hovering has lasted its time and no plan came"},
    {"height_reached", "the height of the take-off is reached"},
    {"take_off_time_over", "the vehicle should have been up by now: check hover throttle, mass and propellers"},
    {"touched_down", "the vehicle is on the ground"},
    {"descent_time_over", "the vehicle should have been down by now: check hover throttle and heights"},
    {"state_back", "good states have come for long enough"},
    {"level_time_over", "the level descent has lasted its time"},
    {"given_back", "the person gave the vehicle back in the air"},
    {"armed_by_others", "the flight controller is armed, and nobody asked for it here"},
    {"checks_pass", "all checks before arming pass"},
    {"check_failed", "a check before arming fails"},
    {"arm_asked", "the arm switch went on"},
    {"armed", "the flight controller is armed and follows us"},
    {"arming_time_over", "the flight controller did not arm in time: it says why in its own log"},
    {"disarm_time_over", "the flight controller did not disarm in time"},
    {"reset", "the switches are back and the motors are off"},
}};

}  // namespace

std::span<const Transition> transitions() noexcept { return kTable; }

std::string_view name(Phase phase) noexcept { return kPhaseTexts[static_cast<std::size_t>(phase)].name; }
std::string_view sentence(Phase phase) noexcept { return kPhaseTexts[static_cast<std::size_t>(phase)].sentence; }
Wanted wanted(Phase phase) noexcept { return kPhaseTexts[static_cast<std::size_t>(phase)].wanted; }
std::string_view name(Cause cause) noexcept { return kCauseTexts[static_cast<std::size_t>(cause)].name; }
std::string_view sentence(Cause cause) noexcept { return kCauseTexts[static_cast<std::size_t>(cause)].sentence; }

}  // namespace gatefield::flight
