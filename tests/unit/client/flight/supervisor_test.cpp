#include "client/flight/supervisor.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/base/random.h"
#include "tests/support/allocation_trap.h"
#include "tests/unit/client/flight/supervised_flight.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

/// Steps until `goal` and says through what.
std::vector<Phase> way_to(Phase goal, SupervisedFlight* flight, Stamp limit) {
  std::vector<Phase> way;
  for (const Stamp end = flight->now + limit; flight->now < end && flight->phase() != goal;)
    if (flight->change(end - flight->now)) way.push_back(flight->phase());
  return way;
}

TEST(Supervisor, AFlightFromSwitchToSwitch) {
  SupervisedFlight flight;
  flight.all_is_well();
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
  flight.switches().arm = true;
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kArming);
  flight.controller().armed = flight.controller().follows_us = true;
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kTakeOff);
  flight.v_W = {0, 0, 0.6};
  EXPECT_TRUE(flight.change(5s));
  EXPECT_EQ(flight.phase(), Phase::kHolding);
  flight.v_W.setZero();
  EXPECT_THAT(way_to(Phase::kRacing, &flight, 5s), ElementsAre(Phase::kHandOver, Phase::kRacing));
  flight.v_W = {2, 0, 0};
  flight.pass(5s);
  EXPECT_EQ(flight.phase(), Phase::kRacing);
  flight.observation().race_over = true;
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kBraking);
  flight.v_W.setZero();
  EXPECT_THAT(way_to(Phase::kDescending, &flight, 2s), ElementsAre(Phase::kHolding, Phase::kDescending));
  flight.v_W = {0, 0, -0.5};
  flight.pass(2s);
  flight.v_W.setZero();  // on the ground
  EXPECT_TRUE(flight.change(2s));
  EXPECT_EQ(flight.phase(), Phase::kLanded);
  flight.controller().armed = false;
  EXPECT_TRUE(flight.change(1s));
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
}

TEST(Supervisor, ASwitchThatIsOnFromTheBeginningArmsNothing) {
  SupervisedFlight flight;
  flight.switches().arm = true;
  flight.all_is_well();
  flight.pass(10s);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
  EXPECT_EQ(flight.supervisor.directive().failing, bit(Check::kArmSwitchOff));
  flight.switches().arm = false;
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
  flight.switches().arm = true;
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kArming);
}

TEST(Supervisor, ASwitchLeftOnAfterALandingArmsNothing) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kLanded));
  flight.controller().armed = false;
  flight.all_is_well();
  flight.pass(10s);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
}

TEST(Supervisor, ArmsByItselfOnceIfToldTo) {
  SupervisorOptions options = SupervisedFlight::usual();
  options.arm_by = ArmBy::kItself;
  options.needs_pilot = false;
  SupervisedFlight flight(options);
  flight.controller().pilot.reset();
  flight.pass(2s);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed) << "not before the checks pass";
  flight.all_is_well();
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kArming);
  flight.controller().armed = flight.controller().follows_us = true;
  flight.step();
  flight.observation().stop_asked = true;
  flight.step();
  flight.controller().on_ground = true;
  EXPECT_THAT(way_to(Phase::kLanded, &flight, 10s), ElementsAre(Phase::kHolding, Phase::kDescending, Phase::kLanded));
  flight.controller().armed = false;
  flight.observation().stop_asked = false;
  flight.pass(10s);
  EXPECT_EQ(flight.phase(), Phase::kReady) << "once";
}

TEST(Supervisor, AControllerWhoseSwitchArmsItAtOnceIsNoStranger) {
  // Betaflight arms by its own switch; its word of that and of the switch come up to a few tenths apart.
  for (const bool armed_first : {true, false}) {
    SupervisedFlight flight;
    ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kReady));
    flight.controller().follows_us = true;
    (armed_first ? flight.controller().armed : flight.switches().arm) = true;
    flight.pass(200ms);
    (armed_first ? flight.switches().arm : flight.controller().armed) = true;
    flight.pass(20ms);
    EXPECT_EQ(flight.phase(), Phase::kTakeOff) << armed_first;
  }
}

TEST(Supervisor, AnArmingThatIsHeardBeforeItsSwitchIsThePersons) {
  // Over a slow link the radio's next word comes long after the autopilot's, which its own switch has armed.
  for (const Stamp late : {50ms, 290ms, 900ms}) {
    SupervisedFlight flight;
    ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kReady));
    flight.controller().pilot_stamp = flight.now;
    flight.controller().armed = flight.controller().follows_us = true;
    for (const Stamp end = flight.now + late; flight.now < end;) {
      flight.step();
      ASSERT_EQ(flight.phase(), Phase::kReady);
      ASSERT_EQ(flight.supervisor.wanted(), Wanted::kReleased) << "it must not be disarmed";
    }
    flight.controller().pilot_stamp = flight.now;
    flight.switches().arm = true;
    flight.pass(20ms);
    EXPECT_EQ(flight.phase(), Phase::kTakeOff) << seconds(late);
  }
}

TEST(Supervisor, AnArmingWhoseSwitchIsHeardToBeOffIsSomebodyElses) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kReady));
  flight.controller().pilot_stamp = flight.now;
  flight.controller().armed = true;
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kReady);
  flight.controller().pilot_stamp = flight.now;
  flight.pass(400ms);
  EXPECT_EQ(flight.phase(), Phase::kYielded);
}

TEST(Supervisor, AskedForArmingItIsDisarmedAgainByUs) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kDisarmed));
  EXPECT_EQ(flight.supervisor.wanted(), Wanted::kDisarmed);
  SupervisedFlight landed;
  ASSERT_NO_FATAL_FAILURE(landed.reach(Phase::kLanded));
  EXPECT_EQ(landed.supervisor.wanted(), Wanted::kDisarmed);
}

TEST(Supervisor, WhoIsArmedByOthersIsLeftToThemUntilGivenBackInTheAir) {
  SupervisedFlight flight;
  flight.switches().arm = true;  // from the beginning, so it arms the firmware and not us
  flight.all_is_well();
  flight.pass(1s);
  flight.controller().armed = flight.controller().follows_us = true;
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kYielded);
  flight.pass(10s);
  EXPECT_EQ(flight.phase(), Phase::kYielded) << "nobody has flown yet";
  flight.switches().take_over = true;
  flight.pass(1s);
  flight.switches().take_over = false;
  flight.pass(5s);
  EXPECT_EQ(flight.phase(), Phase::kYielded) << "on the ground nothing takes off";
  flight.switches().take_over = true;
  flight.v_W = {0, 0, 1};
  flight.pass(1s);
  flight.switches().take_over = false;
  EXPECT_TRUE(flight.change(1s));
  EXPECT_EQ(flight.phase(), Phase::kBraking);
  SupervisedFlight grounded;
  ASSERT_NO_FATAL_FAILURE(grounded.reach(Phase::kYielded));
  grounded.controller().on_ground = true;
  grounded.switches().take_over = false;
  grounded.pass(5s);
  EXPECT_EQ(grounded.phase(), Phase::kYielded) << "the controller says that it is on the ground";
}

TEST(Supervisor, ThePersonComesBeforeEverythingElse) {
  for (std::size_t i = 0; i < kPhases; ++i) {
    const auto phase = static_cast<Phase>(i);
    if (!contains(kInTheAir, phase)) continue;
    for (const bool kill : {false, true}) {
      SupervisedFlight flight;
      ASSERT_NO_FATAL_FAILURE(flight.reach(phase));
      for (const Cause cause : {Cause::kStateLost, Cause::kStateWrong, Cause::kBatteryLow, Cause::kStopAsked,
                                Cause::kRaceOver, Cause::kPlanLost, Cause::kTouchedDown, Cause::kFirmwareFailsafe})
        provoke(cause, &flight);
      provoke(kill ? Cause::kKillAsked : Cause::kTakenOver, &flight);
      flight.step();
      EXPECT_EQ(flight.phase(), kill ? Phase::kKilled : Phase::kYielded) << name(phase);
    }
  }
}

TEST(Supervisor, AControllerThatFollowsSomebodyElseHasBeenTakenOver) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.controller().follows_us = false;
  flight.pass(50ms);
  flight.controller().follows_us = true;
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kRacing) << "one odd word";
  flight.controller().follows_us = false;
  flight.pass(150ms);
  EXPECT_EQ(flight.phase(), Phase::kYielded);
  EXPECT_EQ(flight.supervisor.directive().cause, Cause::kTakenOver);
}

TEST(Supervisor, AShortOutageCostsNothingAndALongOneMakesItJoinSlowly) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kBraking));
  flight.pass(200ms);
  flight.plan(true);
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kRacing);

  flight.plan(false);
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kBraking);
  flight.pass(400ms);
  flight.plan(true);
  flight.pass(1s);
  EXPECT_EQ(flight.phase(), Phase::kBraking) << "still at speed";
  flight.v_W.setZero();
  flight.change(1s);
  EXPECT_EQ(flight.phase(), Phase::kHolding);
  flight.plan(false);
  flight.pass(100ms);
  flight.plan(true);
  const Stamp steady_from = flight.now;
  EXPECT_TRUE(flight.change(3s));
  EXPECT_EQ(flight.phase(), Phase::kHandOver);
  EXPECT_GE(flight.now - steady_from, flight.options.plan_settles);
  const Stamp handed_from = flight.now;
  EXPECT_TRUE(flight.change(3s));
  EXPECT_EQ(flight.phase(), Phase::kRacing);
  EXPECT_GE(flight.now - handed_from, flight.options.hand_over);
}

TEST(Supervisor, AnOutageInTheHandOverDoesNotShortenIt) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kHandOver));
  flight.v_W = {2, 0, 0};
  flight.pass(200ms);
  flight.plan(false);
  flight.step();
  flight.plan(true);
  flight.pass(100ms);
  EXPECT_EQ(flight.phase(), Phase::kBraking);
}

TEST(Supervisor, WhatEndsAFlightEndsItForGood) {
  for (const Cause cause :
       {Cause::kFenceBroken, Cause::kBatteryLow, Cause::kStopAsked, Cause::kRaceOver, Cause::kPilotSilent}) {
    SupervisedFlight flight;
    ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
    const SupervisedFlight well = flight;
    provoke(cause, &flight);
    ASSERT_TRUE(flight.change(3s));
    EXPECT_EQ(flight.phase(), Phase::kBraking) << name(cause);
    // All is well again.
    flight.observation() = const_cast<SupervisedFlight&>(well).observation();
    flight.v_W.setZero();
    flight.p_W.x() = 0;
    EXPECT_THAT(way_to(Phase::kDescending, &flight, 5s), ElementsAre(Phase::kHolding, Phase::kDescending))
        << name(cause);
    flight.pass(900ms);
    EXPECT_EQ(flight.phase(), Phase::kDescending) << name(cause) << ": plans are there, and it lands";
  }
}

TEST(Supervisor, TheFenceLooksAhead) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.p_W = {49.5, 0, 2};
  flight.v_W = {1.0, 0, 0};
  flight.pass(100ms);
  EXPECT_EQ(flight.phase(), Phase::kRacing);
  flight.v_W = {2.9, 0, 0};
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kBraking);
  EXPECT_LT(flight.p_W.x(), 50.0);
  EXPECT_THAT(explain(flight.supervisor.directive(), flight.observation(), flight.options),
              HasSubstr("expected within"));
}

TEST(Supervisor, SaysWhatWasMeasured) {
  const auto said = [](Phase phase, Cause cause) {
    SupervisedFlight flight;
    flight.reach(phase);
    provoke(cause, &flight);
    flight.change(3s);
    return explain(flight.supervisor.directive(), flight.observation(), flight.options);
  };
  EXPECT_THAT(said(Phase::kRacing, Cause::kBatteryLow), HasSubstr("(13.9 V, expected battery_land_v of 14 V or more)"));
  EXPECT_THAT(said(Phase::kRacing, Cause::kStateLost), HasSubstr("(nothing good within 0.15 s)"));
  EXPECT_THAT(said(Phase::kRacing, Cause::kControllerSilent), HasSubstr("(for 0.5 s)"));
  EXPECT_THAT(said(Phase::kReady, Cause::kCheckFailed), HasSubstr("; server_content is no usable depth frame"));
  EXPECT_EQ(said(Phase::kRacing, Cause::kPlanLost), sentence(Cause::kPlanLost));
}

TEST(Supervisor, SaggingForAMomentIsNoEmptyBattery) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  for (int i = 0; i < 10; ++i) {
    flight.controller().battery_v = 13.0;
    flight.pass(400ms);
    flight.controller().battery_v = 14.5;
    flight.pass(100ms);
  }
  EXPECT_EQ(flight.phase(), Phase::kRacing);
}

TEST(Supervisor, AFewBadStatesAreNoLoss) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  for (int i = 0; i < 10; ++i) {
    flight.states_come = false;
    flight.pass(100ms);
    flight.states_come = true;
    flight.pass(50ms);
  }
  EXPECT_EQ(flight.phase(), Phase::kRacing);
}

TEST(Supervisor, AStateThatComesBackBrakesAndJoinsSlowly) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.states_come = false;
  ASSERT_TRUE(flight.change(1s));
  EXPECT_EQ(flight.phase(), Phase::kLevelDescent);
  flight.pass(500ms);
  flight.states_come = true;
  flight.pass(400ms);
  EXPECT_EQ(flight.phase(), Phase::kLevelDescent) << "not yet";
  flight.pass(200ms);
  EXPECT_EQ(flight.phase(), Phase::kBraking);
  flight.v_W.setZero();
  EXPECT_THAT(way_to(Phase::kRacing, &flight, 5s), ElementsAre(Phase::kHolding, Phase::kHandOver, Phase::kRacing));
}

/// All numbers of a state that the law flies by.
std::vector<double*> numbers_of(QuadrotorState* state) {
  std::vector<double*> numbers;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (auto* vector : {&state->p_WB, &state->v_WB, &state->w_WB_B}) numbers.push_back(&(*vector)[i]);
  for (Eigen::Index i = 0; i < 4; ++i) numbers.push_back(&state->q_WB.coeffs()[i]);
  return numbers;
}

TEST(Supervisor, AStateWithANumberThatIsNoneIsNone) {
  QuadrotorState any;
  for (std::size_t i = 0; i < numbers_of(&any).size(); ++i) {
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()}) {
      SupervisedFlight flight;
      ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
      flight.bends = [&](TimedState* state) { *numbers_of(&state->state)[i] = bad; };
      const Stamp begin = flight.now;
      ASSERT_TRUE(flight.change(1s)) << i << " " << bad;
      EXPECT_EQ(flight.supervisor.directive().cause, Cause::kStateLost) << i << " " << bad;
      EXPECT_LE(flight.now - begin, flight.options.state.lost_after + 2 * SupervisedFlight::kStep);
      ASSERT_TRUE(flight.change(1min));
      EXPECT_EQ(flight.phase(), Phase::kKilled) << "in the end";
    }
  }
}

TEST(Supervisor, ABatteryWhoseVoltageIsNoNumberIsLow) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.controller().battery_v = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(flight.change(1s));
  EXPECT_EQ(flight.supervisor.directive().cause, Cause::kBatteryLow);
}

TEST(Supervisor, ALevelDescentLastsAsLongAsTheHeightAsksFor) {
  for (const double height_m : {0.2, 1.0, 10.0}) {
    SupervisedFlight flight;
    ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
    flight.v_W.setZero();
    flight.p_W.z() = 0.1 + height_m;
    flight.pass(200ms);
    flight.states_come = false;
    ASSERT_TRUE(flight.change(1s));
    ASSERT_EQ(flight.phase(), Phase::kLevelDescent);
    const Stamp begin = flight.now;
    ASSERT_TRUE(flight.change(20s));
    EXPECT_EQ(flight.phase(), Phase::kKilled);
    const double fall_s = std::sqrt(2 * height_m / (0.08 * kGravity_m_s2));
    EXPECT_NEAR(seconds(flight.now - begin), std::min(5.0, 1 + 1.5 * fall_s), 0.05) << height_m;
  }
}

TEST(Supervisor, NoPhaseInTheAirLastsForEver) {
  // Whatever stays as it is: everything, or nothing of it is heard any more.
  for (std::size_t i = 0; i < kPhases; ++i) {
    const auto phase = static_cast<Phase>(i);
    if (!contains(kInTheAir, phase)) continue;
    for (const bool deaf : {false, true}) {
      for (const double speed_m_s : {0.0, 0.3}) {
        SupervisedFlight flight;
        ASSERT_NO_FATAL_FAILURE(flight.reach(phase));
        flight.plan(false);
        flight.v_W = {speed_m_s, 0, 0};
        if (deaf) flight.states_come = flight.controller_talks = false;
        const Stamp end = flight.now + 2min;
        while (flight.now < end && contains(kInTheAir, flight.phase())) flight.step();
        EXPECT_FALSE(contains(kInTheAir, flight.phase())) << name(phase) << " " << deaf << " " << speed_m_s;
      }
    }
  }
}

TEST(Supervisor, KilledStaysKilledUntilThePersonHasPutTheSwitchesBack) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.switches().kill = true;
  flight.step();
  flight.controller().armed = false;
  flight.pass(1s);
  flight.switches().kill = false;
  flight.pass(5s);
  EXPECT_EQ(flight.phase(), Phase::kKilled) << "the arm switch is on";
  flight.switches().arm = false;
  flight.pass(200ms);
  EXPECT_EQ(flight.phase(), Phase::kDisarmed);
}

TEST(Supervisor, AKillByTheProgramKillsWithoutARadio) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kRacing));
  flight.controller_talks = false;
  flight.observation().kill_asked = true;
  flight.step();
  EXPECT_EQ(flight.phase(), Phase::kKilled);
}

TEST(Supervisor, ObeysItsTableWhateverItIsTold) {
  Random random(11, Stream("gatefield.test.supervisor"));
  const auto now_and_then = [&](double probability) { return random.uniform(0, 1) < probability; };
  for (int trial = 0; trial < 60; ++trial) {
    SupervisedFlight flight;
    flight.all_is_well();
    bool asked = false;  // a person's switch went from off to on, or a person flew
    for (int i = 0; i < 6000; ++i) {
      const bool arm_before = flight.controller().pilot && flight.switches().arm;
      if (now_and_then(0.01) && flight.controller().pilot) flight.switches().arm = now_and_then(0.7);
      if (now_and_then(0.003) && flight.controller().pilot) flight.switches().take_over = now_and_then(0.3);
      if (now_and_then(0.001) && flight.controller().pilot) flight.switches().kill = now_and_then(0.3);
      if (now_and_then(0.005)) flight.controller().own_failsafe = now_and_then(0.1);
      if (now_and_then(0.01)) flight.plan(now_and_then(0.8));
      if (now_and_then(0.005)) flight.states_come = now_and_then(0.8);
      if (now_and_then(0.003)) flight.controller_talks = now_and_then(0.8);
      if (now_and_then(0.003)) flight.controller().on_ground = now_and_then(0.3);
      if (now_and_then(0.003)) flight.observation().problems = now_and_then(0.2) ? kStateContradictions : 0;
      if (now_and_then(0.02)) flight.v_W = Eigen::Vector3d(random.normal(), 0, 0.5 * random.normal());
      if (now_and_then(0.05))
        flight.controller().armed = flight.controller().follows_us = wanted(flight.phase()) == Wanted::kArmed;
      asked =
          asked || (!arm_before && flight.controller().pilot && flight.switches().arm) || flight.switches().take_over;
      const Directive before = flight.supervisor.directive();
      const Directive& after = flight.step();
      if (after.phase == before.phase) continue;
      const auto line = std::ranges::find_if(transitions(), [&](const Transition& transition) {
        return contains(transition.from, before.phase) && flight.supervisor.there(transition.cause);
      });
      ASSERT_NE(line, transitions().end()) << name(before.phase) << " " << name(after.cause);
      EXPECT_EQ(name(line->cause), name(after.cause)) << "of the lines that fit, the first one counts";
      EXPECT_EQ(name(line->to), name(after.phase)) << name(before.phase) << " " << name(after.cause);
      EXPECT_TRUE(asked || wanted(after.phase) != Wanted::kArmed);
      EXPECT_TRUE(flight.supervisor.state().has_value() || !contains(kByState, after.phase));
    }
  }
}

TEST(Supervisor, AllocatesNothing) {
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(Phase::kHandOver));
  const test::AllocationTrap trap;
  flight.pass(3s);
  flight.plan(false);
  flight.pass(30s);
  EXPECT_EQ(trap.count(), 0u);
}

}  // namespace
}  // namespace gatefield::flight
