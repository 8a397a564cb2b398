#include "client/race/tune/trace.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<Generation> two() {
  Generation one{{2, 1, 0.75, 0.125, 6.5},
                 {{{0.0, 0.5}, {2, 0, 0.25, kNone, kNone}}, {{1.0, 0.5}, {2, 2, 1.25, 0.25, 6.0}}},
                 {0.75, 0.5}};
  return {one, one};
}

TEST(Trace, HasEveryCandidateTheBaseAndTheMean) {
  const auto space = Space::make({{"temperature", 0.1, 10, true}, {"unseen_speed_factor", 0.2, 1, false}}, sheet_of());
  const std::string csv = trace_csv(*space, two());
  EXPECT_THAT(csv, testing::StartsWith(
                       "generation,candidate,score,trials,won,clearance_m,time_s,temperature,unseen_speed_factor\n"
                       "1,base,0.75,2,1,0.125,6.5,1,0.6\n"
                       "1,c01,0.25,2,0,,,0.1,0.6\n"
                       "1,c02,1.25,2,2,0.25,6,10,0.6\n"
                       "1,mean,,,,,,3.162,0.6\n"
                       "2,base,"));
}

TEST(Trace, IsDrawnBestMedianAndBase) {
  const plot::Chart chart = trace_chart("A search", two());
  ASSERT_TRUE(plot::validate(chart).ok()) << plot::validate(chart).error();
  EXPECT_EQ(chart.series[0].y, (std::vector<double>{1.25, 1.25}));
  EXPECT_EQ(chart.series[1].y, (std::vector<double>{0.75, 0.75}));
  EXPECT_EQ(chart.series[2].y, (std::vector<double>{0.75, 0.75}));
}

}  // namespace
}  // namespace gatefield::race
