#include "client/race/flights.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "client/race/files.h"
#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

using FlightPaths = Flown;

simulator::Report flown_for_a_second() {
  simulator::Report flown;
  for (int i = 0; i < 100; ++i) {
    flown.samples.emplace_back();
    flown.samples.back().t_s = 0.01 * i;
    flown.samples.back().state.p_WB = {5.0, 0.05 * i - 2.5, 1.5};
  }
  return flown;
}

TEST_F(FlightPaths, AreKeptAt25PointsASecondAndShownAtTheGoal) {
  const std::string path = path_text(flown_for_a_second());
  EXPECT_EQ(std::count(path.begin(), path.end(), '\n'), 1 + 25 + 1) << path;
  EXPECT_THAT(path, HasSubstr("\n0.040,5.0000,-2.3000,1.5000,0.000\n"));
  Folder folder;
  for (const char* file : {"paths/a-6-5.csv", "paths/a-8-5.csv"})
    ASSERT_TRUE(put_file(folder.path() / file, path).ok());
  ASSERT_TRUE(put_file(folder.path() / "paths/a-6-7.csv", "header\nnonsense\n").ok());

  const ShownFlights shown = shown_flights(folder.path(), campaign_.cells[0], results_);
  EXPECT_EQ(shown.speed_m_s, 6) << "the goal's, though 8 was flown too";
  ASSERT_EQ(shown.flights.size(), 1u) << "what can't be read is left out";
  EXPECT_EQ(shown.flights[0].points.size(), 26u);
  EXPECT_TRUE(shown_flights(folder.path(), campaign_.cells[1], results_).flights.empty());
}

TEST_F(FlightPaths, OverAnotherLinkHaveNoPictureOfTheirOwn) {
  EXPECT_TRUE(has_flights_picture(campaign_, campaign_.cells[1]));
  campaign_.figures.back().against = Against::kDelay;
  EXPECT_FALSE(has_flights_picture(campaign_, campaign_.cells[1]));
}

}  // namespace
}  // namespace gatefield::race
