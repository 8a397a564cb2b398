#include "client/flight/plan_watch.h"

#include <gtest/gtest.h>

namespace gatefield::flight {
namespace {

using namespace std::chrono_literals;

TEST(PlanWatch, WithoutAPlanThereIsNothingToCount) {
  const PlanWatch watch(20ms);
  EXPECT_FALSE(watch.heard_any());
  EXPECT_EQ(watch.count(5s).periods, 0u);
  EXPECT_EQ(watch.count(5s).without_plan, 0u);
}

TEST(PlanWatch, APlanAPeriodLeavesNoneOut) {
  PlanWatch watch(20ms);
  for (int i = 0; i < 50; ++i) watch.on_plan(static_cast<std::uint64_t>(i + 1), 1s + i * 20ms);
  EXPECT_EQ(watch.newest(), 1s + 49 * 20ms);
  const auto count = watch.count(1s + 50 * 20ms);
  EXPECT_EQ(count.periods, 51u);
  EXPECT_EQ(count.without_plan, 0u);
}

TEST(PlanWatch, AGapCountsThePeriodsThatBroughtNothing) {
  PlanWatch watch(20ms);
  watch.on_plan(1, 1000ms);
  watch.on_plan(2, 1100ms);
  EXPECT_EQ(watch.count(1100ms).without_plan, 4u);
  EXPECT_EQ(watch.count(1200ms).without_plan, 4u + 4u) << "silence up to the end counts, too";
}

TEST(PlanWatch, PlansThatCameUnseenWhileTheReaderWasLateDidCome) {
  PlanWatch watch(20ms);
  watch.on_plan(1, 1000ms);
  watch.on_plan(6, 1100ms);
  EXPECT_EQ(watch.count(1100ms).without_plan, 0u);
}

TEST(PlanWatch, AServerThatBeginsAnewBroughtOnePlan) {
  PlanWatch watch(20ms);
  watch.on_plan(500, 1000ms);
  watch.on_plan(1, 1100ms);
  EXPECT_EQ(watch.count(1100ms).without_plan, 4u);
}

TEST(PlanWatch, JitterOfLessThanHalfAPeriodIsNoGap) {
  PlanWatch watch(20ms);
  watch.on_plan(1, 1000ms);
  watch.on_plan(2, 1029ms);
  watch.on_plan(3, 1040ms);
  EXPECT_EQ(watch.count(1040ms).without_plan, 0u);
}

}  // namespace
}  // namespace gatefield::flight
