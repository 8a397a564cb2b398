#include "server/service/costs.h"

#include <gtest/gtest.h>

#include "server/service/processor_time.h"
#include "server/service/trial.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using namespace std::chrono_literals;

planner::Profile profile(const std::string& name, int samples = 1000, int steps = 20, double rate_hz = 50) {
  planner::Profile made;
  made.name = name;
  made.samples = samples;
  made.steps = steps;
  made.control_rate_hz = rate_hz;
  return made;
}

TEST(Costs, AVehicleTakesWhatItsStepsAndFramesTake) {
  Costs costs;
  costs.learn_step(profile("race"), 2ms);
  costs.learn_look(500us);
  const Need need = costs.of(profile("race"), 60);
  EXPECT_NEAR(need.control, 0.1, 1e-9) << "2 ms, 50 times a second";
  EXPECT_NEAR(need.perception, 0.03, 1e-9);
  EXPECT_NEAR(need.other, Costs::kUsualOther_cores, 1e-9);
  EXPECT_NEAR(need.all(), 0.13 + Costs::kUsualOther_cores, 1e-9);
}

TEST(Costs, AProfileThatNobodyFlewIsJudgedByTheDearestOnesRollouts) {
  Costs costs;
  EXPECT_EQ(costs.of(profile("race"), 60).control, 0.0) << "nothing is known";
  costs.learn_step(profile("race"), 2ms);
  costs.learn_step(profile("cheap"), 1ms);
  EXPECT_NEAR(costs.of(profile("new", 2000, 10, 100), 60).control, 0.2, 1e-9);
  EXPECT_NEAR(costs.of(profile("race", 500), 60).control, 0.05, 1e-9) << "read again with fewer samples";
}

TEST(Costs, MoreIsBelievedSoonAndLessLater) {
  Costs costs;
  costs.learn_step(profile("race"), 2ms);
  for (int i = 0; i < 8; ++i) costs.learn_step(profile("race"), 4ms);
  EXPECT_GT(costs.of(profile("race"), 60).control, 0.19);
  for (int i = 0; i < 8; ++i) costs.learn_step(profile("race"), 2ms);
  EXPECT_GT(costs.of(profile("race"), 60).control, 0.17);
  for (int i = 0; i < 200; ++i) costs.learn_step(profile("race"), 2ms);
  EXPECT_NEAR(costs.of(profile("race"), 60).control, 0.1, 1e-3);
}

/// A planner that takes its time, on this thread's processor.
TEST(Trial, FindsOutWhatAProfileCosts) {
  Factories factories = testing::fake_factories();
  factories.planner = [](const planner::Profile& made,
                         const protocol::SessionRequest& request) -> Result<std::unique_ptr<planner::Planner>> {
    const auto script = std::make_shared<testing::FakePlanner::Script>();
    script->during = [slow = made.name == "slow"] {
      const auto begin = processor_time_of_thread();
      while (slow && processor_time_of_thread() - begin < 5ms) continue;
    };
    return std::unique_ptr<planner::Planner>(std::make_unique<testing::FakePlanner>(made, request.quadrotor, script));
  };
  const Costs costs = costs_by_trial({{"slow", profile("slow")}, {"quick", profile("quick")}}, factories);
  EXPECT_GE(costs.of(profile("slow"), 0).control, 0.25) << "5 ms, 50 times a second";
  EXPECT_LT(costs.of(profile("slow"), 0).control, 0.5);
  EXPECT_LT(costs.of(profile("quick"), 0).control, 0.05);
  EXPECT_GT(costs.of(profile("quick"), 60).perception, 0.0);
}

TEST(Trial, AFactoryThatRefusesLeavesItUnknown) {
  Factories factories = testing::fake_factories();
  factories.sensor = [](const protocol::SessionRequest&) -> Result<std::unique_ptr<perception::GateSensor>> {
    return Error("knows another course");
  };
  const Costs costs = costs_by_trial({{"race", profile("race")}}, factories);
  EXPECT_EQ(costs.of(profile("race"), 60).control, 0.0);
}

}  // namespace
}  // namespace gatefield::service
