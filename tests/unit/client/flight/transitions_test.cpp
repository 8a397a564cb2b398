#include "client/flight/transitions.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/unit/client/flight/supervised_flight.h"

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

struct Edge {
  Phase from;
  Cause cause;
  Phase to;
};

std::vector<Edge> edges() {
  std::vector<Edge> all;
  for (const Transition& transition : transitions())
    for (std::size_t i = 0; i < kPhases; ++i)
      if (contains(transition.from, static_cast<Phase>(i)))
        all.push_back({static_cast<Phase>(i), transition.cause, transition.to});
  return all;
}

/// What has to pass before a cause counts: since it was provoked or, where time alone is the cause, in the phase.
Stamp earliest(Cause cause, const SupervisorOptions& options) {
  switch (cause) {
    case Cause::kStateLost:
      return options.state.lost_after;
    case Cause::kStateWrong:
      return options.state_doubted;
    case Cause::kBatteryLow:
      return options.battery_low;
    case Cause::kControllerSilent:
      return options.controller_silent;
    case Cause::kPilotSilent:
      return options.pilot_silent;
    case Cause::kPlanSteady:
      return options.plan_settles;
    case Cause::kHandedOver:
      return options.hand_over;
    case Cause::kBrakeTimeOver:
      return options.brake_limit;
    case Cause::kHoldTimeOver:
      return options.hold_limit;
    case Cause::kTakeOffTimeOver:
      return options.take_off_limit;
    case Cause::kDescentTimeOver:
      return options.descent_limit;
    case Cause::kStateBack:
      return options.state_settles;
    case Cause::kGivenBack:
      return options.give_back;
    case Cause::kArmingTimeOver:
      return options.arming_limit;
    case Cause::kDisarmTimeOver:
      return options.disarm_limit;
    default:
      return Stamp{0};
  }
}

class EveryTransition : public testing::TestWithParam<Edge> {};

TEST_P(EveryTransition, HappensWhenItsCauseDoes) {
  const auto [from, cause, to] = GetParam();
  SupervisedFlight flight;
  ASSERT_NO_FATAL_FAILURE(flight.reach(from));
  const Stamp provoked = flight.now;
  provoke(cause, &flight);
  ASSERT_TRUE(flight.change(2min)) << "stays " << name(from);
  const Directive& directive = flight.supervisor.directive();
  EXPECT_EQ(name(directive.from), name(from));
  EXPECT_EQ(name(directive.cause), name(cause));
  EXPECT_EQ(name(directive.phase), name(to));
  EXPECT_EQ(directive.since, flight.now);
  EXPECT_GE(flight.now - provoked, earliest(cause, flight.options)) << "not before its time";
}

INSTANTIATE_TEST_SUITE_P(Supervisor, EveryTransition, testing::ValuesIn(edges()), [](const auto& edge) {
  return std::string(name(edge.param.from)) + "__" + std::string(name(edge.param.cause));
});

TEST(Transitions, EveryPhaseAndEveryCauseHasALine) {
  for (std::size_t i = 0; i < kCauses; ++i) {
    const auto cause = static_cast<Cause>(i);
    bool used = false;
    for (const Transition& transition : transitions()) used = used || transition.cause == cause;
    EXPECT_TRUE(used) << name(cause);
    EXPECT_FALSE(sentence(cause).empty());
  }
  for (std::size_t i = 0; i < kPhases; ++i) {
    const auto phase = static_cast<Phase>(i);
    bool entered = false, left = false;
    for (const Transition& transition : transitions()) {
      entered = entered || transition.to == phase;
      left = left || contains(transition.from, phase);
    }
    EXPECT_TRUE(entered && left) << name(phase);
    EXPECT_FALSE(sentence(phase).empty());
  }
}

TEST(Transitions, MotorsAreAskedForInTheAirAndWhileArmingOnly) {
  for (std::size_t i = 0; i < kPhases; ++i) {
    const auto phase = static_cast<Phase>(i);
    EXPECT_EQ(wanted(phase) == Wanted::kArmed, contains(kInTheAir | Phase::kArming, phase)) << name(phase);
  }
  EXPECT_EQ(wanted(Phase::kYielded), Wanted::kReleased);
  EXPECT_EQ(wanted(Phase::kKilled), Wanted::kKilled);
}

}  // namespace
}  // namespace gatefield::flight
