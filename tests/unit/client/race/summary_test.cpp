#include "client/race/summary.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

TEST(Wilson, IsTheIntervalOfTheBooks) {
  // R: binom::binom.confint(x, n, methods = "wilson")
  EXPECT_NEAR(wilson(8, 10).low, 0.4901625, 1e-6);
  EXPECT_NEAR(wilson(8, 10).high, 0.9433178, 1e-6);
  EXPECT_NEAR(wilson(20, 20).low, 0.8388748, 1e-6);
  EXPECT_EQ(wilson(20, 20).high, 1.0);
  EXPECT_EQ(wilson(0, 20).low, 0.0);
  EXPECT_NEAR(wilson(0, 20).high, 0.1611252, 1e-6);
  EXPECT_NEAR(wilson(98, 100).low, 0.9299, 1e-4);
  EXPECT_EQ(wilson(0, 0).low, 0.0);
  EXPECT_EQ(wilson(0, 0).high, 1.0);
}

TEST(Median, LeavesOutWhatIsNotFinite) {
  const double nan = std::nan("");
  EXPECT_EQ(median_of({nan, 4, 1, 2, nan, 8}), 3) << "the mean of the middle two";
  EXPECT_TRUE(std::isnan(median_of({nan})));
}

using Summaries = Flown;

TEST_F(Summaries, CountByCellAndSpeed) {
  const auto lines = summarize(campaign_, results_);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[1].cell, "a");
  EXPECT_EQ(lines[1].speed_m_s, 6);
  EXPECT_EQ(lines[1].trials, 4u);
  EXPECT_EQ(lines[1].won, 3u);
  EXPECT_DOUBLE_EQ(lines[1].top_speed_m_s, 6.5);
  EXPECT_DOUBLE_EQ(lines[1].median_time_s, 5.875);
  EXPECT_EQ(lines[1].failures.at(Failure::kPassedBeside), 1u);
}

}  // namespace
}  // namespace gatefield::race
