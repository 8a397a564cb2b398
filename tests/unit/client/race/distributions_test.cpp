#include "client/race/distributions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using testing::ElementsAre;

std::vector<std::string> words_of(const std::vector<plot::Cell>& row) {
  std::vector<std::string> words;
  for (const plot::Cell& cell : row) words.push_back(cell.text);
  return words;
}

using Distributions = Flown;

TEST_F(Distributions, ClearancesAreOverAllGatesOfAllTrialsWonAndLost) {
  double next_m = 0.0;
  for (TrialResult& result : results_)
    if (result.cell == "a" && result.speed_m_s == 6)
      for (int i = 0; i < 25; ++i) result.clearances_m.push_back(next_m += 1.0 / 128);  // 100 of them over four trials
    else
      result.clearances_m.clear();
  const auto table = clearance_table(campaign_, results_);
  ASSERT_EQ(table.rows.size(), 1u) << "no row without a passage";
  EXPECT_THAT(words_of(table.rows[0]),
              ElementsAre("first", "6.0", "discs", "100", "0.008", "0.016", "0.046", "0.201", "0.395"));
}

TEST_F(Distributions, LapsAndSpeedsAreOfRacesWonMissesOfAll) {
  for (TrialResult& result : results_) {
    if (result.cell != "b") continue;
    result.median_lap_s = 2.0 + 0.125 * static_cast<double>(result.seed);
    result.slowest_lap_s = result.median_lap_s + 1.0;
    result.mean_speed_m_s = 6.0;
    result.missed = result.seed == 5 || result.seed == 6 ? 1 : 0;
    result.retries = result.seed == 5 ? 2 : 0;
  }
  const auto table = pace_table(campaign_, results_);
  ASSERT_EQ(table.rows.size(), 3u);
  // Seeds 5, 7 and 8 won; 6 missed a gate and lost.
  EXPECT_THAT(words_of(table.rows[2]), ElementsAre("b", "7.0", "3", "2", "2", "2", "2.88", "4.00", "7.5", "6.00"));
}

TEST_F(Distributions, LeaveOutTrialsWithoutAServer) {
  for (TrialResult& result : results_) result.failure = Failure::kLostServer;
  EXPECT_TRUE(clearance_table(campaign_, results_).rows.empty());
  EXPECT_TRUE(pace_table(campaign_, results_).rows.empty());
}

}  // namespace
}  // namespace gatefield::race
