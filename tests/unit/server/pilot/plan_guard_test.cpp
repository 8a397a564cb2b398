#include "server/pilot/plan_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

namespace gatefield::pilot {
namespace {

using protocol::bit;
using protocol::Problem;
using ::testing::HasSubstr;

planner::Plan hover_plan(const QuadrotorModel& model) {
  planner::Plan plan;
  plan.steps = 20;
  for (std::size_t k = 0; k < 20; ++k) {
    plan.thrust_rate_n_s[k].setZero();
    plan.state[k].thrust_n = plan.state[k].thrust_command_n = hover_thrust_n(model);
  }
  return plan;
}

TEST(PlanGuard, SaysWhyAPlanIsWithheldAndWhatHealthTellsOfIt) {
  struct Row {
    const char* what;
    std::function<void(planner::Plan*)> spoil;
    Withheld why;
    protocol::Problems problems;
    const char* sentence;
  };
  const QuadrotorModel model;
  const double nan = std::nan("");
  const Row kNotFinite{"", {}, Withheld::kNotFinite, bit(Problem::kPlanNotFinite), "not finite"};
  const Row kRate{"", {}, Withheld::kRateLimit, bit(Problem::kPlanThrustRate), "thrust rate"};
  const Row kThrust{"", {}, Withheld::kThrustLimit, bit(Problem::kPlanThrust), "rotor thrust was beyond"};
  const Row kBodyRate{"", {}, Withheld::kBodyRate, bit(Problem::kPlanBodyRate), "body rate was beyond 200 rad/s"};
  const auto row = [](Row like, const char* what, std::function<void(planner::Plan*)> spoil) {
    like.what = what;
    like.spoil = std::move(spoil);
    return like;
  };
  for (const Row& r : {
           row(kNotFinite, "no steps", [](auto* plan) { plan->steps = 0; }),
           row(kNotFinite, "thrust rate", [&](auto* plan) { plan->thrust_rate_n_s[7][2] = nan; }),
           row(kNotFinite, "thrust", [&](auto* plan) { plan->state[0].thrust_command_n[1] = INFINITY; }),
           row(kNotFinite, "body rate", [&](auto* plan) { plan->state[19].w_WB_B.z() = nan; }),
           row(kRate, "up", [&](auto* p) { p->thrust_rate_n_s[3][0] = model.thrust_rate_max_n_s + 0.01; }),
           row(kRate, "down", [&](auto* p) { p->thrust_rate_n_s[3][0] = -model.thrust_rate_max_n_s - 0.01; }),
           row(kThrust, "much", [&](auto* p) { p->state[5].thrust_command_n[3] = model.thrust_max_n + 0.01; }),
           row(kThrust, "little", [&](auto* p) { p->state[5].thrust_command_n[3] = model.thrust_min_n - 0.01; }),
           row(kBodyRate, "one axis",
               [](auto* p) {
                 p->state[11].w_WB_B = {0, -200.0, 0};
               }),
           row(kBodyRate, "all axes",
               [](auto* p) {
                 p->state[11].w_WB_B = {120, 120, 120};
               }),
       }) {
    planner::Plan plan = hover_plan(model);
    r.spoil(&plan);
    const Withheld why = why_withheld(model, plan);
    EXPECT_EQ(why, r.why) << r.what;
    EXPECT_EQ(problems(why), r.problems) << r.what;
    EXPECT_THAT(sentence(why), HasSubstr(r.sentence)) << r.what;
  }
}

TEST(PlanGuard, LetsAPlanPassAtItsLimitsButForRounding) {
  const QuadrotorModel model;
  planner::Plan plan = hover_plan(model);
  plan.thrust_rate_n_s[0].setConstant(model.thrust_rate_max_n_s + 1e-4);
  plan.thrust_rate_n_s[1].setConstant(-model.thrust_rate_max_n_s - 1e-4);
  plan.state[2].thrust_command_n.setConstant(model.thrust_max_n + 1e-4);
  plan.state[3].thrust_command_n.setConstant(model.thrust_min_n - 1e-4);
  plan.state[4].w_WB_B = {199.9, 0, 0};
  const Withheld why = why_withheld(model, plan);
  EXPECT_EQ(why, Withheld::kNothing);
  EXPECT_EQ(problems(why), 0u);
  EXPECT_STREQ(sentence(why), "");
}

TEST(PlanGuard, LooksOnlyAtWhatIsSent) {
  const QuadrotorModel model;
  planner::Plan plan = hover_plan(model);
  plan.state[20].w_WB_B.x() = 500.0;
  EXPECT_EQ(why_withheld(model, plan), Withheld::kNothing);
}

}  // namespace
}  // namespace gatefield::pilot
