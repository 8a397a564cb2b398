#include "client/flight/arming_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/base/text.h"

namespace gatefield::flight {
namespace {

constexpr double kStillSpeed_m_s = 0.3, kStillRate_rad_s = 0.5;
constexpr double kStillTilt_rad = 0.35;  // 20 deg

double tilt_rad(const QuadrotorState& state) noexcept {
  return std::acos(std::clamp((state.q_WB.toRotationMatrix())(2, 2), -1.0, 1.0));
}

bool still(const QuadrotorState& state) noexcept {
  return state.v_WB.norm() <= kStillSpeed_m_s && state.w_WB_B.norm() <= kStillRate_rad_s &&
         tilt_rad(state) <= kStillTilt_rad;
}

constexpr std::array<std::string_view, kChecks> kNames{
    "controller_heard", "pilot_heard", "arm_switch_off", "not_taken_over", "firmware_failsafe",
    "battery",          "state_fresh", "still",          "inside_fence",   "server_answers",
    "round_trip",       "field_seen",  "server_content", "flight_wanted",  "attitudes_agree"};

std::string told(Stamp span) { return text(seconds(span)) + " s"; }

}  // namespace

std::optional<double> tilt_apart_rad(const Observation& observation) noexcept {
  if (!observation.state || !observation.controller || !observation.controller->q_WB) return std::nullopt;
  const auto up_B = [](const PlainQuaternion& q_WB) -> Eigen::Vector3d {
    return q_WB.normalized().conjugate() * Eigen::Vector3d::UnitZ();
  };
  const double cosine = up_B(observation.state->state.q_WB).dot(up_B(*observation.controller->q_WB));
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

Checks failing(const Observation& observation, const CheckMemory& memory, const SupervisorOptions& options) noexcept {
  Checks failed = 0;
  const auto need = [&](Check check, bool passes) { failed |= passes ? 0 : bit(check); };
  const bool by_switch = options.arm_by == ArmBy::kSwitch;
  const auto& controller = observation.controller;

  need(Check::kControllerHeard, memory.controller_fresh);
  need(Check::kPilotHeard, memory.pilot_fresh || !(options.needs_pilot || by_switch));
  need(Check::kArmSwitchOff, memory.switch_was_off || !by_switch);
  const auto pilot = controller ? controller->pilot : std::nullopt;
  need(Check::kNotTakenOver, !pilot || !(pilot->take_over || pilot->kill));
  const FirmwareFailsafe failsafe = controller ? controller->failsafe : FirmwareFailsafe::kNotChecked;
  need(Check::kFirmwareFailsafe, failsafe == FirmwareFailsafe::kGood ||
                                     (failsafe == FirmwareFailsafe::kNotChecked && !options.needs_firmware_failsafe));
  need(Check::kBattery, options.battery_arm_v <= 0 ||
                            (controller && controller->battery_v && *controller->battery_v >= options.battery_arm_v));
  need(Check::kStateFresh, memory.state_settled);
  need(Check::kStill, observation.state && still(observation.state->state));
  need(Check::kInsideFence,
       !options.fence || (observation.state && options.fence->holds(observation.state->state.p_WB)));
  need(Check::kServerAnswers, observation.plan_valid && observation.round_trip);
  need(Check::kRoundTrip, !observation.round_trip || *observation.round_trip <= options.round_trip_max);
  need(Check::kFieldSeen, observation.field_seen || !options.needs_field);
  need(Check::kServerContent, (observation.problems & keeps_on_the_ground(options)) == 0);
  need(Check::kFlightWanted, !(observation.race_over || observation.stop_asked));
  need(Check::kAttitudesAgree, memory.attitudes_agree);
  return failed;
}

std::string_view name(Check check) noexcept { return kNames[static_cast<std::size_t>(check)]; }

std::vector<Check> list(Checks checks) {
  std::vector<Check> found;
  for (int i = 0; i < kChecks; ++i)
    if (checks >> i & 1) found.push_back(static_cast<Check>(i));
  return found;
}

Error explain(Check check, const Observation& observation, const SupervisorOptions& options) {
  const auto& controller = observation.controller;
  const auto error = [&](std::string value, std::string expected) {
    return Error::invalid(std::string(name(check)), std::move(value), std::move(expected));
  };
  switch (check) {
    case Check::kControllerHeard:
      return error(controller ? "older than " + told(options.controller_silent) : "nothing so far",
                   "a word of the flight controller every " + told(options.controller_silent) +
                       " or sooner: check device, port and baud rate");
    case Check::kPilotHeard:
      return error("nothing",
                   "switches of the person's radio: switch the transmitter on, or say needs_pilot: false "
                   "and arm_by: ITSELF where there is none");
    case Check::kArmSwitchOff:
      return error("on", "off, then on when everything else is ready: put the arm switch back");
    case Check::kNotTakenOver:
      return error("the take-over or kill switch is on", "both off: put them back");
    case Check::kFirmwareFailsafe:
      return error(controller && controller->failsafe == FirmwareFailsafe::kBad ? "off or too slow" : "not checked",
                   "a firmware that lands or stops by itself when setpoints end: set it up as docs/safety.md says, or "
                   "say needs_firmware_failsafe: false where it can't be read");
    case Check::kBattery:
      return error(controller && controller->battery_v ? text(*controller->battery_v) + " V" : "not told",
                   "battery_arm_v (" + text(options.battery_arm_v) +
                       " V) or more: charge it, or have the flight "
                       "controller tell its voltage");
    case Check::kStateFresh:
      return error(observation.state ? "with gaps, jumps, or old" : "nothing so far",
                   "good states for " + told(options.state_settles) + " without a gap of " +
                       told(options.state.lost_after) + ": check source, rate and stamps");
    case Check::kStill: {
      if (!observation.state) return error("not known", "a vehicle that stands: see state_fresh");
      const QuadrotorState& state = observation.state->state;
      return error(text(state.v_WB.norm()) + " m/s, tilted by " + text(tilt_rad(state)) + " rad",
                   "at most " + text(kStillSpeed_m_s) + " m/s and " + text(kStillTilt_rad) +
                       " rad: put it down, level, and check the attitude's axes");
    }
    case Check::kInsideFence:
      return error(observation.state ? text(observation.state->state.p_WB) + " m" : "not known",
                   options.fence ? text(options.fence->low_W) + " to " + text(options.fence->high_W) +
                                       " m: move the vehicle or the fence"
                                 : "no fence");
    case Check::kServerAnswers:
      return error("no plan within a second", "plans: check that the server runs and what telemetry says");
    case Check::kRoundTrip:
      return error(observation.round_trip ? told(*observation.round_trip) : "not known",
                   "round_trip_max (" + told(options.round_trip_max) + ") or less: check the link to the server");
    case Check::kFieldSeen:
      return error("no", "the first gate in view of the camera, or needs_field: false where it can't be from here");
    case Check::kServerContent: {
      std::string found;
      for (const protocol::Problem problem : protocol::list(observation.problems & keeps_on_the_ground(options)))
        found += (found.empty() ? "" : "; ") + std::string(protocol::sentence(problem));
      return error(found, "a server that finds nothing of this kind wrong");
    }
    case Check::kFlightWanted:
      return error("over, or asked to stop", "a flight that has not ended: start the program again");
    case Check::kAttitudesAgree: {
      const auto apart_rad = tilt_apart_rad(observation);
      return error((apart_rad ? text(*apart_rad) : "an unknown angle") + " rad apart now, and was too much before",
                   "states whose roll and pitch are the flight controller's within tilt_apart_rad (" +
                       text(options.tilt_apart_rad) +
                       " rad): check the source's axes and how its body was defined, calibrate the flight "
                       "controller's accelerometer, then start again");
    }
  }
  return error("", "");
}

}  // namespace gatefield::flight
