#include "client/race/figures.h"

#include <gtest/gtest.h>

#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using Figures = Flown;

TEST_F(Figures, DrawSuccessAgainstWhatTheFigureAsksFor) {
  const auto lines = summarize(campaign_, results_);
  const auto speed = success_chart(campaign_, campaign_.figures[0], lines);
  ASSERT_EQ(speed.series.size(), 2u);
  EXPECT_EQ(speed.series[0].x, (std::vector<double>{6, 8})) << "in order, though the cell is not";
  EXPECT_EQ(speed.series[0].y, (std::vector<double>{75, 75}));
  EXPECT_EQ(speed.series[1].name, "Others: first");
  EXPECT_TRUE(plot::validate(speed).ok()) << plot::validate(speed).error();
  const auto position = success_chart(campaign_, campaign_.figures[1], lines);
  ASSERT_EQ(position.series.size(), 1u);
  EXPECT_EQ(position.series[0].x, std::vector<double>{0.3});
  const auto failures = failure_chart(campaign_, campaign_.figures[1], lines);
  ASSERT_EQ(failures.series.size(), 1u);
  EXPECT_TRUE(plot::validate(failures).ok()) << plot::validate(failures).error();
  EXPECT_EQ(failures.series[0].y[3], 25.0);
}

}  // namespace
}  // namespace gatefield::race
