#include "client/flight/supervisor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "common/base/text.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kBriefly = 100ms;   // one odd word of the controller decides nothing
constexpr Stamp kArmedFor = 300ms;  // the switch has said since that it is off, or there is none
constexpr Stamp kSlowFor = 200ms;
constexpr Stamp kApartFor = 500ms;  // what one says late, while the vehicle is carried about, is less
constexpr Stamp kRestsFor = 1s;
constexpr Stamp kRestsHighUpFor = 3s;    // the law asks for half the weight by then
constexpr double kLevelTilt_cos = 0.94;  // 20 deg
constexpr double kResting_m_s = 0.12;    // of a vehicle that should sink at 0.1 m/s or more
constexpr double kNearGround_m = 0.2, kAboveGround_m = 0.5;
constexpr double kHeightReached_m = 0.1;

template <typename Facts>
void put(Facts* facts, Cause cause, bool there) noexcept {
  facts->set(static_cast<std::size_t>(cause), there);
}

}  // namespace

double Supervisor::height_m() const noexcept {
  if (!state_.newest() || !ground_z_m_) return std::numeric_limits<double>::infinity();
  return state_.newest()->state.p_WB.z() - *ground_z_m_;
}

// What the person's radio says; nothing where it is not heard.
PilotSwitches Supervisor::switches() const noexcept {
  return controller_ ? controller_->pilot.value_or(PilotSwitches{}) : PilotSwitches{};
}

// A switch that arms the controller at once has said so to us, or will with the radio's next word.
bool Supervisor::switch_unheard_since_arming() const noexcept {
  if (options_.arm_by != ArmBy::kSwitch || !controller_->pilot || controller_->pilot->arm) return false;
  const Stamp said = controller_->pilot_stamp == Stamp{0} ? controller_->stamp : controller_->pilot_stamp;
  return said <= *armed_at_;
}

Wanted Supervisor::wanted() const noexcept {
  return standing() && armed_at_ ? Wanted::kReleased : flight::wanted(directive_.phase);
}

// Takes in what the step brought: everything that has to hold for a while is counted here.
void Supervisor::listen(Stamp now, const Observation& observation) noexcept {
  if (observation.state) state_.take(now, *observation.state);
  state_.pass(now);

  const auto& heard = observation.controller;
  controller_ = heard && now - heard->stamp <= options_.controller_silent ? heard : std::nullopt;
  const bool piloted = controller_ && controller_->pilot;
  const PilotSwitches pilot = switches();

  controller_silent_.update(now, !controller_);
  pilot_silent_.update(now, controller_ && !piloted);
  not_following_.update(now, controller_ && !controller_->follows_us);
  motors_off_.update(now, controller_ && !controller_->armed);
  battery_low_.update(now, controller_ && controller_->battery_v && options_.battery_land_v > 0 &&
                               !(*controller_->battery_v >= options_.battery_land_v));
  contradicting_.update(now, (observation.problems & kStateContradictions) != 0);
  agreeing_.update(now, !contradicting_.for_at_least(now, 0s));
  planned_.update(now, observation.plan_valid);
  if (!controller_ || !controller_->armed)
    armed_at_.reset();
  else if (!armed_at_)
    armed_at_ = controller_->stamp;
  armed_unasked_.update(now, armed_at_ && !switch_unheard_since_arming());
  on_ground_.update(now, controller_ && controller_->on_ground.value_or(false));
  free_.update(now, controller_ && controller_->armed && controller_->follows_us && !controller_->own_failsafe &&
                        !(pilot.take_over || pilot.kill) && (piloted || !options_.needs_pilot) &&
                        (options_.arm_by != ArmBy::kSwitch || pilot.arm));

  const auto apart_rad = tilt_apart_rad(observation);
  tilts_apart_.update(now,
                      !flying() && state_.fresh() && controller_ && apart_rad && *apart_rad > options_.tilt_apart_rad);
  if (tilts_apart_.for_at_least(now, kApartFor)) attitudes_agree_ = false;

  const bool known = state_.fresh();
  const double speed_m_s = known ? state_.newest()->state.v_WB.norm() : 0.0;
  const bool level = known && state_.newest()->state.q_WB.normalized().toRotationMatrix()(2, 2) >= kLevelTilt_cos;
  slow_.update(now, level && speed_m_s <= options_.stopped_m_s);
  // Who is told to sink has begun to after a second, unless the ground is in the way.
  resting_.update(now, is(Phase::kDescending) && in_phase_for(now, kRestsFor) && level &&
                           speed_m_s <= std::min(kResting_m_s, 0.5 * options_.descent_m_s));

  if (piloted && !pilot.arm && !flying() && !is(Phase::kArming)) switch_was_off_ = true;
  if (is(Phase::kYielded) && controller_ && (pilot.take_over || !controller_->follows_us || controller_->own_failsafe))
    was_yielded_ = true;
}

Supervisor::Facts Supervisor::ends_of_flight(Stamp now, const Observation& observation) const noexcept {
  Facts found;
  if (options_.fence && state_.fresh()) {
    const QuadrotorState& state = state_.newest()->state;
    put(&found, Cause::kFenceBroken,
        !options_.fence->holds(state.p_WB) ||
            !options_.fence->holds(state.p_WB + seconds(options_.fence_ahead) * state.v_WB));
  }
  put(&found, Cause::kBatteryLow, battery_low_.for_at_least(now, options_.battery_low));
  put(&found, Cause::kControllerSilent, controller_silent_.for_at_least(now, 0s));
  put(&found, Cause::kPilotSilent, options_.needs_pilot && pilot_silent_.for_at_least(now, options_.pilot_silent));
  put(&found, Cause::kStopAsked, observation.stop_asked);
  put(&found, Cause::kRaceOver, observation.race_over);
  return found;
}

// From what was known last, with the level descent's share of the weight: up to the top, down from there, and half as
// long again for what the thrust may be off.
Stamp Supervisor::time_to_the_ground() const noexcept {
  if (!state_.newest() || !ground_z_m_) return options_.level_limit;
  const double sink_m_s2 = (1.0 - options_.level_thrust) * kGravity_m_s2;
  const double up_m_s = std::max(0.0, state_.newest()->state.v_WB.z());
  const double top_m = std::max(0.0, height_m()) + up_m_s * up_m_s / (2 * sink_m_s2);
  return kRestsFor + from_seconds(std::min(60.0, 1.5 * (up_m_s / sink_m_s2 + std::sqrt(2 * top_m / sink_m_s2))));
}

// The controller's own detector, or a vehicle that is asked to sink and rests: at once where it stood before, for
// longer where there may be something else below it.
bool Supervisor::touched_down(Stamp now) const noexcept {
  if (in_phase_for(now, kRestsFor) && on_ground_.for_at_least(now, kSlowFor)) return true;
  return resting_.for_at_least(now, height_m() <= kNearGround_m ? kSlowFor : kRestsHighUpFor);
}

Supervisor::Facts Supervisor::facts(Stamp now, const Observation& observation) const noexcept {
  Facts found = for_good_;
  const auto say = [&](Cause cause, bool there) { put(&found, cause, there); };
  const bool piloted = controller_ && controller_->pilot;
  const PilotSwitches pilot = switches();
  const bool by_switch = options_.arm_by == ArmBy::kSwitch;
  const bool goes_on = for_good_.none();
  const bool content =
      state_.settled(now, options_.state_settles) && agreeing_.for_at_least(now, options_.state_settles);

  say(Cause::kKillAsked, observation.kill_asked || pilot.kill);
  say(Cause::kArmSwitchOff, by_switch && piloted && !pilot.arm);
  say(Cause::kTakenOver, pilot.take_over || (flying() && not_following_.for_at_least(now, kBriefly)));
  say(Cause::kFirmwareFailsafe, controller_ && controller_->own_failsafe);
  say(Cause::kMotorsOff, motors_off_.for_at_least(now, kBriefly));

  say(Cause::kStateLost, !state_.fresh());
  say(Cause::kStateWrong, contradicting_.for_at_least(now, options_.state_doubted));
  say(Cause::kStateBack, directive_.cause != Cause::kDescentTimeOver && content);
  say(Cause::kLevelTimeOver, in_phase_for(now, level_for_));

  say(Cause::kPlanLost, !observation.plan_valid);
  say(Cause::kPlanBack, goes_on && observation.plan_valid && directive_.cause == Cause::kPlanLost &&
                            directive_.from == Phase::kRacing && !in_phase_for(now, options_.outage_short));
  say(Cause::kPlanSteady, goes_on && planned_.for_at_least(now, options_.plan_settles) && content &&
                              (is(Phase::kHolding) || height_m() >= kAboveGround_m));
  say(Cause::kHandedOver, in_phase_for(now, options_.hand_over));
  say(Cause::kStopped, slow_.for_at_least(now, kSlowFor));
  say(Cause::kBrakeTimeOver, in_phase_for(now, options_.brake_limit));
  say(Cause::kHoldTimeOver, in_phase_for(now, options_.hold_limit));
  say(Cause::kHeightReached, height_m() >= options_.take_off_height_m - kHeightReached_m);
  say(Cause::kTakeOffTimeOver, in_phase_for(now, options_.take_off_limit));
  say(Cause::kTouchedDown, touched_down(now));
  say(Cause::kDescentTimeOver, in_phase_for(now, options_.descent_limit));

  const bool on_ground = on_ground_.for_at_least(now, 0s);
  const bool airborne =
      !on_ground && (ground_z_m_ ? height_m() >= kAboveGround_m : controller_ && controller_->on_ground.has_value());
  say(Cause::kGivenBack, was_yielded_ && airborne && content && free_.for_at_least(now, options_.give_back));
  say(Cause::kArmedByOthers, armed_unasked_.for_at_least(now, kArmedFor));
  say(Cause::kChecksPass, directive_.failing == 0);
  say(Cause::kCheckFailed, directive_.failing != 0);
  say(Cause::kArmAsked, by_switch ? switch_was_off_ && pilot.arm : !armed_itself_);
  say(Cause::kArmed, controller_ && controller_->armed && controller_->follows_us);
  say(Cause::kArmingTimeOver, in_phase_for(now, options_.arming_limit));
  say(Cause::kDisarmTimeOver, in_phase_for(now, options_.disarm_limit));
  say(Cause::kReset, motors_off_.for_at_least(now, kBriefly) && !observation.kill_asked && !pilot.kill &&
                         (!by_switch || (piloted && !pilot.arm)));
  return found;
}

Checks Supervisor::failing_checks(Stamp now, const Observation& observation) const noexcept {
  const bool arming = is(Phase::kArming);
  const CheckMemory memory{.controller_fresh = controller_.has_value(),
                           .pilot_fresh = controller_ && controller_->pilot,
                           .switch_was_off = switch_was_off_ || arming,
                           .state_settled = state_.settled(now, options_.state_settles),
                           .attitudes_agree = attitudes_agree_};
  // Rotors that start shake the vehicle.
  const bool starting = arming || (is(Phase::kReady) && armed_at_);
  return failing(observation, memory, options_) & ~(starting ? bit(Check::kStill) : 0);
}

const Directive& Supervisor::update(Stamp now, const Observation& observation) noexcept {
  listen(now, observation);
  if (!flying()) directive_.failing = failing_checks(now, observation);
  if (flying()) for_good_ |= ends_of_flight(now, observation);
  facts_ = facts(now, observation);
  for (const Transition& transition : transitions()) {
    if (!contains(transition.from, directive_.phase) || !there(transition.cause)) continue;
    enter(now, transition);
    break;
  }
  return directive_;
}

void Supervisor::enter(Stamp now, const Transition& transition) noexcept {
  directive_.from = directive_.phase;
  directive_.phase = transition.to;
  directive_.cause = transition.cause;
  directive_.since = now;
  switch (transition.to) {
    case Phase::kDisarmed:
      for_good_.reset();
      break;
    case Phase::kArming:
      switch_was_off_ = false;
      armed_itself_ = true;
      ground_z_m_ = state_.newest()->state.p_WB.z();  // kStateFresh passed
      break;
    case Phase::kYielded:
      was_yielded_ = transition.cause != Cause::kArmedByOthers;
      if (!was_yielded_) ground_z_m_ = state_.fresh() ? std::optional(state_.newest()->state.p_WB.z()) : std::nullopt;
      break;
    case Phase::kLevelDescent:
      level_for_ = std::min(options_.level_limit, time_to_the_ground());
      break;
    case Phase::kDescending:
      // Who does not get up has too little thrust for anything else.
      if (transition.cause == Cause::kTakeOffTimeOver) put(&for_good_, Cause::kTakeOffTimeOver, true);
      break;
    default:
      break;
  }
}

std::string explain(const Directive& directive, const Observation& observation, const SupervisorOptions& options) {
  std::string said(sentence(directive.cause));
  const auto& controller = observation.controller;
  switch (directive.cause) {
    case Cause::kFenceBroken:
      if (observation.state && options.fence)
        said += " (at " + text(observation.state->state.p_WB) + " m with " + text(observation.state->state.v_WB) +
                " m/s, expected within " + text(options.fence->low_W) + " to " + text(options.fence->high_W) + " m)";
      break;
    case Cause::kBatteryLow:
      if (controller && controller->battery_v)
        said += " (" + text(*controller->battery_v) + " V, expected battery_land_v of " + text(options.battery_land_v) +
                " V or more)";
      break;
    case Cause::kStateLost:
      said += " (nothing good within " + text(seconds(options.state.lost_after)) + " s)";
      break;
    case Cause::kControllerSilent:
      said += " (for " + text(seconds(options.controller_silent)) + " s)";
      break;
    case Cause::kPilotSilent:
      said += " (for " + text(seconds(options.pilot_silent)) + " s)";
      break;
    case Cause::kCheckFailed:
      for (const Check check : list(directive.failing)) said += "; " + explain(check, observation, options).message;
      break;
    default:
      break;
  }
  return said;
}

}  // namespace gatefield::flight
