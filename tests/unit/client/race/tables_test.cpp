#include "client/race/tables.h"

#include <gtest/gtest.h>

#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using Tables = Flown;

TEST_F(Tables, HaveARowForEachCellAndSpeed) {
  const auto lines = summarize(campaign_, results_);
  const auto table = success_table(campaign_, lines);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.rows[1][0].text, "first");
  EXPECT_EQ(table.rows[1][5].text, "75");
  EXPECT_EQ(table.rows[1][6].text, "30");
  EXPECT_EQ(table.rows[1][7].text, "95");
  EXPECT_EQ(table.rows[1][8].text, "90");
  EXPECT_EQ(table.rows[0][8].text, "-") << "the goal is of the other speed";
  EXPECT_EQ(table.rows[1].back().text, "1 passed beside");
}

TEST_F(Tables, CountRacesWonInWhichAGateWasFlownAgain) {
  for (TrialResult& result : results_)
    if (result.cell == "a" && result.speed_m_s == 6) result.missed = 1;
  const auto table = success_table(campaign_, summarize(campaign_, results_));
  ASSERT_EQ(table.columns[12].find("missed"), 0u);
  EXPECT_EQ(table.rows[1][4].text, "3");
  EXPECT_EQ(table.rows[1][12].text, "3") << "the one that was lost doesn't count";
  EXPECT_EQ(table.rows[0][12].text, "0");
}

TEST_F(Tables, StandBesideWhatOthersPublished) {
  const auto table = comparison_table(campaign_, summarize(campaign_, results_));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.columns[1], "Others");
  EXPECT_EQ(table.rows[0][1].text, "87 % at 7 m/s");
  EXPECT_EQ(table.rows[0][2].text, "75 % (30 to 95)");
}

}  // namespace
}  // namespace gatefield::race
