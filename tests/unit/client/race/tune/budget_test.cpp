#include "client/race/tune/budget.h"

#include <gtest/gtest.h>

namespace gatefield::race {
namespace {

TEST(Budget, TrialsHaveRoomForTheComparisonFirst) {
  const Costs costs{30, 40, {}};
  EXPECT_EQ(generations_within({.trials = 39, .minutes = {}}, costs), 0u);
  EXPECT_EQ(generations_within({.trials = 69, .minutes = {}}, costs), 0u);
  EXPECT_EQ(generations_within({.trials = 70, .minutes = {}}, costs), 1u);
  EXPECT_EQ(generations_within({.trials = 200, .minutes = {}}, costs), 5u);
}

TEST(Budget, MinutesCountByWhatTrialsHaveTaken) {
  Costs costs{30, 40, {}};
  EXPECT_EQ(generations_within({.trials = {}, .minutes = 10}, costs), 1u) << "nothing is known yet";
  costs.per_trial_s = 2.0;  // 300 trials
  EXPECT_EQ(generations_within({.trials = {}, .minutes = 10}, costs), 8u);
  costs.per_trial_s = 60.0;
  EXPECT_EQ(generations_within({.trials = {}, .minutes = 10}, costs), 1u) << "the first one is flown anyhow";
}

TEST(Budget, TheFirstThatIsReachedCounts) {
  const Costs costs{30, 40, 2.0};
  EXPECT_EQ(generations_within({.trials = 100, .minutes = 10}, costs), 2u);
  EXPECT_EQ(generations_within({.trials = 1000, .minutes = 10}, costs), 8u);
  EXPECT_EQ(generations_within({.trials = 10, .minutes = 10}, costs), 0u);
}

}  // namespace
}  // namespace gatefield::race
