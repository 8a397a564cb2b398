#include "server/pilot/plan_guard.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>

namespace gatefield::pilot {
namespace {

using protocol::bit;
using protocol::Problem;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const QuadrotorModel kModel;

/// Hovers.
planner::Plan good_plan() {
  planner::Plan plan;
  plan.steps = 20;
  plan.thrust_rate_n_s.fill(ThrustRates::Zero());
  for (QuadrotorState& state : plan.state) state.thrust_n = state.thrust_command_n = hover_thrust_n(kModel);
  return plan;
}

/// What is said of a plan whose last step is spoiled.
template <typename Spoil>
Withheld spoiled(const Spoil& spoil) {
  planner::Plan plan = good_plan();
  spoil(&plan.thrust_rate_n_s[19], &plan.state[19]);
  return why_withheld(kModel, Actuation::Kind::kRotorThrusts, plan);
}

TEST(PlanGuard, LetsThroughWhatTheVehicleCanDo) {
  EXPECT_EQ(why_withheld(kModel, Actuation::Kind::kRotorThrusts, good_plan()), Withheld::kNothing);
  EXPECT_EQ(spoiled([](ThrustRates* rates, QuadrotorState* state) {
              rates->setConstant(-kModel.thrust_rate_max_n_s);
              state->thrust_command_n.setConstant(kModel.thrust_max_n);
              state->w_WB_B = {0, 0, 199};
            }),
            Withheld::kNothing);
}

TEST(PlanGuard, WithholdsAPlanOfNoStepsOrWithoutNumbers) {
  planner::Plan none = good_plan();
  none.steps = 0;
  EXPECT_EQ(why_withheld(kModel, Actuation::Kind::kRotorThrusts, none), Withheld::kNotFinite);
  EXPECT_EQ(spoiled([](ThrustRates* rates, QuadrotorState*) { (*rates)[2] = kNan; }), Withheld::kNotFinite);
  EXPECT_EQ(spoiled([](ThrustRates*, QuadrotorState* state) { state->thrust_command_n[1] = kNan; }),
            Withheld::kNotFinite);
  EXPECT_EQ(spoiled([](ThrustRates*, QuadrotorState* state) { state->w_WB_B.z() = kNan; }), Withheld::kNotFinite);
}

TEST(PlanGuard, WithholdsWhatIsBeyondALimit) {
  EXPECT_EQ(spoiled([](ThrustRates* rates, QuadrotorState*) { (*rates)[0] = kModel.thrust_rate_max_n_s + 0.01; }),
            Withheld::kRateLimit);
  EXPECT_EQ(
      spoiled([](ThrustRates*, QuadrotorState* state) { state->thrust_command_n[3] = kModel.thrust_max_n + 0.01; }),
      Withheld::kThrustLimit);
  EXPECT_EQ(
      spoiled([](ThrustRates*, QuadrotorState* state) { state->thrust_command_n[3] = kModel.thrust_min_n - 0.01; }),
      Withheld::kThrustLimit);
  EXPECT_EQ(spoiled([](ThrustRates*, QuadrotorState* state) { state->w_WB_B = {150, 150, 0}; }), Withheld::kBodyRate);
}

TEST(PlanGuard, HoldsWhatIsAskedForAgainstTheVehicleToo) {
  const auto asked = [](const RateCommand& command) {
    planner::Plan plan = good_plan();
    plan.rate_command.fill(hover_command(kModel));
    plan.rate_command[19] = command;
    return why_withheld(kModel, Actuation::Kind::kBodyRates, plan);
  };
  EXPECT_EQ(asked({8, 9, -9, 6}), Withheld::kNothing);
  EXPECT_EQ(asked({8, kNan, 0, 0}), Withheld::kNotFinite);
  EXPECT_EQ(asked({-0.1, 0, 0, 0}), Withheld::kThrustLimit);
  EXPECT_EQ(asked({4 * kModel.thrust_max_n + 0.1, 0, 0, 0}), Withheld::kThrustLimit);
  EXPECT_EQ(asked({8, 150, 150, 0}), Withheld::kBodyRate);
}

TEST(PlanGuard, LooksNoFartherThanThePlansSteps) {
  planner::Plan plan = good_plan();
  plan.thrust_rate_n_s[20][0] = kNan;
  EXPECT_EQ(why_withheld(kModel, Actuation::Kind::kRotorThrusts, plan), Withheld::kNothing);
}

TEST(PlanGuard, EachReasonHasAProblemAndASentenceOfItsOwn) {
  EXPECT_EQ(problems(Withheld::kNothing), 0u);
  EXPECT_STREQ(sentence(Withheld::kNothing), "");
  EXPECT_EQ(problems(Withheld::kNotFinite), bit(Problem::kPlanNotFinite));
  EXPECT_EQ(problems(Withheld::kRateLimit), bit(Problem::kPlanThrustRate));
  EXPECT_EQ(problems(Withheld::kThrustLimit), bit(Problem::kPlanThrust));
  EXPECT_EQ(problems(Withheld::kBodyRate), bit(Problem::kPlanBodyRate));
  const std::set<std::string> sentences{sentence(Withheld::kNotFinite), sentence(Withheld::kRateLimit),
                                        sentence(Withheld::kThrustLimit), sentence(Withheld::kBodyRate)};
  EXPECT_EQ(sentences.size(), 4u);
}

}  // namespace
}  // namespace gatefield::pilot
