#include "client/sdk/plan_player.h"

#include <gtest/gtest.h>

#include <numeric>

#include "client/sdk/fallback.h"
#include "common/protocol/validate.h"
#include "tests/support/allocation_trap.h"
#include "tests/support/messages.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;

// Rates 1, 2, 3, ... N/s in the intervals; thrusts are their integral from `first_n`; body rates 0.1, 0.2, ... about x.
protocol::ThrustRateCommand plan(Stamp start, int steps = 4, Stamp step = 10ms, Stamp validity = 1s,
                                 double first_n = 2.0) {
  protocol::ThrustRateCommand command = test::good_command("drone", 1, steps);
  command.plan_start = start;
  command.plan_step = step;
  command.validity = validity;
  double thrust_n = first_n;
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    const double rate = static_cast<double>(k) + 1.0;
    thrust_n += rate * seconds(step);
    command.thrust_rate_n_s[k].setConstant(rate);
    command.rotor_thrust_n[k].setConstant(thrust_n);
    command.body_rates_rad_s[k] = {0.1 * rate, 0, 0};
  }
  return command;
}

// Commands 10, 11, 12, ... N and 0.1, 0.2, ... rad/s about x that hold during the intervals.
protocol::ThrustRateCommand rates_plan(Stamp start, int steps = 4, Stamp step = 10ms) {
  protocol::ThrustRateCommand command = plan(start, steps, step);
  command.actuation = Actuation::Kind::kBodyRates;
  for (std::size_t k = 0; k < static_cast<std::size_t>(steps); ++k) {
    command.thrust_rate_n_s[k].setZero();
    command.rotor_thrust_n[k].setZero();
    command.collective_thrust_n[k] = 10.0 + static_cast<double>(k);
  }
  return command;
}

double rate_at(const PlanPlayer& player, Stamp now) {
  const auto setpoint = player.at(now, 0ms);
  return setpoint ? setpoint->thrust_rate_n_s[0] : -1.0;
}

TEST(PlanPlayer, SaysNothingWithoutAPlan) { EXPECT_FALSE(PlanPlayer().at(1s, 0ms).has_value()); }

TEST(PlanPlayer, PlaysTheIntervalThatHoldsNow) {
  PlanPlayer player;
  player.take(plan(100ms));
  EXPECT_EQ(rate_at(player, 100ms), 1);
  EXPECT_EQ(rate_at(player, 110ms - 1ns), 1);
  EXPECT_EQ(rate_at(player, 110ms), 2);
  EXPECT_EQ(rate_at(player, 139ms), 4);
  EXPECT_EQ(player.at(100ms, 0ms)->source, Setpoint::Source::kPlan);
}

TEST(PlanPlayer, EndsWithTheLastStepOrTheValidityWhicheverComesFirst) {
  PlanPlayer player;
  player.take(plan(100ms));
  EXPECT_TRUE(player.at(140ms - 1ns, 0ms).has_value());
  EXPECT_FALSE(player.at(140ms, 0ms).has_value());
  player.take(plan(200ms, 4, 10ms, 25ms));
  EXPECT_TRUE(player.at(225ms - 1ns, 0ms).has_value());
  EXPECT_FALSE(player.at(225ms, 0ms).has_value());
}

TEST(PlanPlayer, ThrustsFollowTheirRatesWithinAnInterval) {
  PlanPlayer player;
  player.take(plan(100ms));
  EXPECT_NEAR(player.at(100ms, 0ms)->rotor_thrust_n[2], 2.0, 1e-12);
  EXPECT_NEAR(player.at(105ms, 0ms)->rotor_thrust_n[2], 2.0 + 0.005, 1e-12);
  EXPECT_NEAR(player.at(110ms, 0ms)->rotor_thrust_n[2], 2.0 + 0.010, 1e-12);
  EXPECT_NEAR(player.at(115ms, 0ms)->rotor_thrust_n[2], 2.0 + 0.010 + 0.010, 1e-12);
  EXPECT_NEAR(player.at(115ms, 0ms)->collective_thrust_n, 4 * 2.020, 1e-12);
  EXPECT_NEAR(player.at(115ms, 0ms)->body_rates_rad_s.x(), 0.15, 1e-12);
}

TEST(PlanPlayer, ThrustsAndBodyRatesAreThoseAtTheEndOfThePeriod) {
  PlanPlayer player;
  player.take(plan(100ms));
  for (const Stamp now : {100ms, 107ms, 112ms}) {
    const auto held = player.at(now, 12ms);
    EXPECT_EQ(held->rotor_thrust_n, player.at(now + 12ms, 0ms)->rotor_thrust_n);
    EXPECT_EQ(held->collective_thrust_n, player.at(now + 12ms, 0ms)->collective_thrust_n);
    EXPECT_EQ(held->body_rates_rad_s, player.at(now + 12ms, 0ms)->body_rates_rad_s);
    EXPECT_EQ(held->thrust_rate_n_s, player.at(now, 0ms)->thrust_rate_n_s) << "the rate is the one that holds now";
  }
}

TEST(PlanPlayer, APeriodThatGoesBeyondThePlanEndsWithItsLastValues) {
  PlanPlayer player;
  player.take(plan(100ms));
  const auto last = player.at(135ms, 20ms);
  ASSERT_TRUE(last.has_value());
  EXPECT_NEAR(last->rotor_thrust_n[0], plan(100ms).rotor_thrust_n[3][0], 1e-12);
}

// Lockstep: every turn a new plan that starts from what the rotors were asked for last.
TEST(PlanPlayer, HeldThrustsThatGoBackIntoTheNextPlanIntegrateIt) {
  PlanPlayer player;
  double asked_n = 2.0;
  for (Stamp now{0}; now < 100ms; now += 5ms) {
    player.take(plan(now, 4, 10ms, 1s, asked_n));  // begins at 1 N/s
    asked_n = player.at(now, 5ms)->rotor_thrust_n[0];
  }
  EXPECT_NEAR(asked_n, 2.0 + 0.1, 1e-12);
}

TEST(PlanPlayer, AThrustAtItsLimitStaysThere) {
  PlanPlayer player;
  protocol::ThrustRateCommand command = plan(0ms, 2, 100ms);
  command.rotor_thrust_n[0].setConstant(10.0);
  command.rotor_thrust_n[1].setConstant(10.0);  // the rate says on, the limit says no
  command.thrust_rate_n_s[1].setConstant(30.0);
  player.take(command);
  EXPECT_EQ(player.at(120ms, 0ms)->rotor_thrust_n[0], 10.0);
}

TEST(PlanPlayer, CommandsOfBodyRatesHoldForTheirIntervalWhateverThePeriod) {
  PlanPlayer player;
  player.take(rates_plan(100ms));
  for (const Stamp period : {0ms, 3ms, 50ms}) {
    for (const Stamp now : {Stamp(100ms), Stamp(104ms), Stamp(110ms - 1ns)}) {
      EXPECT_EQ(player.at(now, period)->collective_thrust_n, 10.0);
      EXPECT_EQ(player.at(now, period)->body_rates_rad_s, Eigen::Vector3d(0.1, 0, 0));
    }
    EXPECT_EQ(player.at(110ms, period)->collective_thrust_n, 11.0);
    EXPECT_EQ(player.at(139ms, period)->collective_thrust_n, 13.0) << "nothing lies beyond the last";
    EXPECT_EQ(player.at(95ms, period)->collective_thrust_n, 10.0) << "begun a step early";
  }
  EXPECT_FALSE(player.at(140ms, 0ms));
}

TEST(PlanPlayer, APlanOfBodyRatesSaysNothingOfRotors) {
  PlanPlayer player;
  player.take(rates_plan(100ms));
  const auto setpoint = player.at(125ms, 5ms);
  EXPECT_EQ(setpoint->source, Setpoint::Source::kPlan);
  EXPECT_TRUE(setpoint->rotor_thrust_n.isZero(0));
  EXPECT_TRUE(setpoint->thrust_rate_n_s.isZero(0));
  EXPECT_TRUE(protocol::validate(rates_plan(100ms)).ok());
}

TEST(PlanPlayer, AnOlderPlanGoesOnUntilTheNewerOneBegins) {
  PlanPlayer player;
  player.take(plan(100ms, 20));
  player.take(plan(150ms, 20));
  EXPECT_EQ(rate_at(player, 149ms), 5);
  EXPECT_EQ(rate_at(player, 150ms), 1);
}

TEST(PlanPlayer, SeveralPlansMayLieInTheFuture) {
  PlanPlayer player;
  for (int i = 0; i < 4; ++i) player.take(plan(100ms + i * 20ms, 10));
  EXPECT_EQ(rate_at(player, 115ms), 2);
  EXPECT_EQ(rate_at(player, 125ms), 1);
  EXPECT_EQ(rate_at(player, 155ms), 2);
  EXPECT_EQ(rate_at(player, 165ms), 1);
}

TEST(PlanPlayer, AnOlderPlanDoesNotComeBackWhenTheNewerOneIsOver) {
  PlanPlayer player;
  player.take(plan(100ms, 40));
  player.take(plan(150ms, 2));
  EXPECT_TRUE(player.at(169ms, 0ms).has_value());
  EXPECT_FALSE(player.at(171ms, 0ms).has_value());
}

TEST(PlanPlayer, APlanThatBeginsEarlierReplacesWhatWasToComeLater) {
  PlanPlayer player;
  player.take(plan(200ms, 20));
  player.take(plan(100ms, 20));
  EXPECT_EQ(rate_at(player, 205ms), 11);
}

TEST(PlanPlayer, TheFirstPlanBeginsAtMostOneStepEarly) {
  PlanPlayer player;
  player.take(plan(100ms));
  EXPECT_FALSE(player.at(89ms, 0ms).has_value());
  ASSERT_TRUE(player.at(90ms, 0ms).has_value());
  EXPECT_NEAR(player.at(95ms, 0ms)->rotor_thrust_n[0], 2.0, 1e-12);
}

TEST(PlanPlayer, AnIntegratedPlanReachesItsThrusts) {
  PlanPlayer player;
  player.take(plan(0ms, 20, 30ms));
  double thrust_n = 2.0;
  for (Stamp now{0}; now < 600ms; now += 1ms) thrust_n += rate_at(player, now) * 1e-3;
  EXPECT_NEAR(thrust_n, plan(0ms, 20, 30ms).rotor_thrust_n[19][0], 1e-9);
}

TEST(RealTime, PlayingAndFallingBackDoNotAllocate) {
  const protocol::ThrustRateCommand command = plan(0ms, 20, 30ms);
  const QuadrotorModel model;
  PlanPlayer player;
  Fallback fallback(model);
  QuadrotorState state = test::good_state().state;
  double sum = 0;
  const test::AllocationTrap trap;
  player.take(command);
  for (Stamp now{0}; now < 1s; now += 10ms) {
    const auto setpoint = player.at(now, 0ms);
    sum += (setpoint ? *setpoint : fallback.update(now, state)).collective_thrust_n;
  }
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_GT(sum, 0);
}

}  // namespace
}  // namespace gatefield::sdk
