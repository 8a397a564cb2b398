#pragma once

#include <gtest/gtest.h>

#include <functional>

#include "client/flight/supervisor.h"

namespace gatefield::flight {

/// A vehicle under a supervisor, with time in the test's hand: what it is told is a member, its position follows the
/// velocity that the test sets.
class SupervisedFlight {
 public:
  static constexpr Stamp kStep = std::chrono::milliseconds(10);

  explicit SupervisedFlight(const SupervisorOptions& told = usual()) : options(told), supervisor(told) {
    told_.controller.emplace();
    auto& said = controller();
    said.on_ground = false;
    said.pilot.emplace();
    said.battery_v = 16.0;
    said.failsafe = FirmwareFailsafe::kGood;
    told_.problems = 0;
  }

  static SupervisorOptions usual() {
    SupervisorOptions options;
    options.fence = Fence{{-50, -50, -1}, {50, 50, 20}};
    options.battery_arm_v = 15.0;
    options.battery_land_v = 14.0;
    options.battery_low = options.pilot_silent = std::chrono::milliseconds(500);
    return options;
  }

  SupervisorOptions options;
  Supervisor supervisor;
  Stamp now = std::chrono::seconds(100);
  Eigen::Vector3d p_W{1, 2, 0.1}, v_W = Eigen::Vector3d::Zero();
  bool states_come = true, controller_talks = true;
  std::function<void(TimedState*)> bends;  ///< done to each state before it is told

  Observation& observation() { return told_; }
  ControllerStatus& controller() { return *told_.controller; }
  PilotSwitches& switches() { return *controller().pilot; }
  Phase phase() const { return supervisor.directive().phase; }

  /// Everything before arming is as it should be.
  void all_is_well() {
    plan(true);
    told_.field_seen = true;
  }
  void plan(bool comes) {
    told_.plan_valid = comes;
    told_.round_trip = comes ? std::optional<Stamp>(std::chrono::milliseconds(20)) : std::nullopt;
  }

  const Directive& step() {
    now += kStep;
    p_W += seconds(kStep) * v_W;
    if (states_come) {
      told_.state.emplace();
      told_.state->stamp = now;
      told_.state->state.p_WB = p_W;
      told_.state->state.v_WB = v_W;
      if (bends) bends(&*told_.state);
    }
    if (controller_talks) controller().stamp = now;
    return supervisor.update(now, told_);
  }
  void pass(Stamp span) {
    for (const Stamp end = now + span; now < end;) step();
  }
  /// Steps until the phase is another one. @return false: it did not change in time
  bool change(Stamp limit) {
    const Phase before = phase();
    for (const Stamp end = now + limit; now < end;)
      if (step().phase != before) return true;
    return false;
  }

  /// Brings a fresh vehicle into this phase, at its first step in it, along the usual way.
  void reach(Phase goal) {
    go(goal);
    ASSERT_EQ(phase(), goal) << name(phase()) << " because of " << name(supervisor.directive().cause);
  }

 private:
  void go(Phase goal) {
    using namespace std::chrono_literals;
    pass(1s);
    if (goal == Phase::kDisarmed) return;
    if (goal == Phase::kKilled) {
      switches().kill = true;
      pass(kStep);
      return;
    }
    all_is_well();
    change(5s);
    if (goal == Phase::kReady) return;
    switches().arm = true;
    change(1s);
    if (goal == Phase::kArming) return;
    controller().armed = controller().follows_us = true;
    change(1s);
    if (goal == Phase::kTakeOff) return;
    plan(false);
    v_W = {0, 0, 0.6};
    change(5s);
    v_W.setZero();
    if (goal == Phase::kHolding) return;
    if (goal == Phase::kLevelDescent) {
      states_come = false;
      change(1s);
      return;
    }
    if (goal == Phase::kYielded) {
      switches().take_over = true;
      change(1s);
      return;
    }
    if (goal == Phase::kDescending || goal == Phase::kLanded) {
      change(20s);
      if (goal == Phase::kDescending) return;
      controller().on_ground = true;
      change(5s);
      return;
    }
    plan(true);
    change(3s);
    if (goal == Phase::kHandOver) return;
    change(3s);
    v_W = {2, 0, 0};
    if (goal == Phase::kRacing) return;
    pass(500ms);
    plan(false);
    change(1s);
  }

  Observation told_;
};

/// Makes the cause happen and nothing else, if time alone does not.
inline void provoke(Cause cause, SupervisedFlight* flight) {
  switch (cause) {
    case Cause::kKillAsked:
      flight->switches().kill = true;
      return;
    case Cause::kArmSwitchOff:
      flight->switches().arm = false;
      return;
    case Cause::kTakenOver:
      flight->switches().take_over = true;
      return;
    case Cause::kFirmwareFailsafe:
      flight->controller().own_failsafe = true;
      return;
    case Cause::kMotorsOff:
      flight->controller().armed = false;
      return;
    case Cause::kStateLost:
      flight->states_come = false;
      return;
    case Cause::kStateWrong:
      flight->observation().problems = protocol::bit(protocol::Problem::kVelocityAgainstMotion);
      return;
    case Cause::kFenceBroken:
      flight->p_W.x() = 51;
      return;
    case Cause::kBatteryLow:
      flight->controller().battery_v = 13.9;
      return;
    case Cause::kControllerSilent:
      flight->controller_talks = false;
      return;
    case Cause::kPilotSilent:
      flight->controller().pilot.reset();
      return;
    case Cause::kStopAsked:
      flight->observation().stop_asked = true;
      return;
    case Cause::kRaceOver:
      flight->observation().race_over = true;
      return;
    case Cause::kPlanLost:
      flight->plan(false);
      return;
    case Cause::kPlanBack:
    case Cause::kPlanSteady:
      flight->plan(true);
      return;
    case Cause::kStopped:
      flight->v_W.setZero();
      return;
    case Cause::kHeightReached:
      flight->v_W = {0, 0, 0.6};
      return;
    case Cause::kDescentTimeOver:
      flight->v_W = {0.3, 0, 0};  // neither down nor at rest
      return;
    case Cause::kTouchedDown:
      flight->controller().on_ground = true;
      return;
    case Cause::kStateBack:
      flight->states_come = true;
      return;
    case Cause::kGivenBack:
      flight->switches().take_over = false;
      return;
    case Cause::kArmedByOthers:
      flight->controller().armed = true;
      return;
    case Cause::kChecksPass:
      flight->all_is_well();
      return;
    case Cause::kCheckFailed:
      flight->observation().problems = protocol::bit(protocol::Problem::kDepthMissing);
      return;
    case Cause::kArmAsked:
      flight->switches().arm = true;
      return;
    case Cause::kArmed:
      flight->controller().armed = flight->controller().follows_us = true;
      return;
    case Cause::kReset:
      flight->switches() = {};
      flight->controller().armed = false;
      return;
    case Cause::kHandedOver:
    case Cause::kBrakeTimeOver:
    case Cause::kHoldTimeOver:
    case Cause::kTakeOffTimeOver:
    case Cause::kLevelTimeOver:
    case Cause::kArmingTimeOver:
    case Cause::kDisarmTimeOver:
      return;  // time alone
  }
  FAIL() << "how is " << name(cause) << " provoked?";
}

}  // namespace gatefield::flight
