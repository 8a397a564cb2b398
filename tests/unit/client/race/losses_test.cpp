#include "client/race/losses.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/flown.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

using Losses = Flown;

TEST_F(Losses, AreCountedByCause) {
  for (TrialResult& result : results_) {
    if (result.won()) continue;
    result.cause = Cause::kPerceptionWrong;
    result.belief_error_m = 0.5;
  }
  const auto lines = summarize(campaign_, results_);
  const auto table = cause_table(campaign_, lines, results_);
  ASSERT_EQ(table.rows.size(), failure_table(lines).rows.size());
  EXPECT_EQ(table.rows[0][3].text, "1");
  EXPECT_EQ(table.rows[0][4].text, "1") << "perception wrong";
  EXPECT_EQ(table.rows[0][table.columns.size() - 3].text, "0.50");
  EXPECT_THAT(table.note, HasSubstr("over the last 0.6 s the gate was believed more than"));
}

TEST_F(Losses, ListWhatWasLostWithTheLineThatFliesItAgain) {
  const std::string list = failure_list(campaign_, results_);
  EXPECT_THAT(list, HasSubstr("# a at 6 m/s, seed 6: not recorded, passed beside: missed gate 2"));
  EXPECT_THAT(list, HasSubstr("\ngatefield-sim --lockstep --scenario cells/b.txt --seed 6 --speed 7 --profile race "
                              "--laps 1 --delay-ms 40\n"));
  EXPECT_THAT(list, HasSubstr("at (1.00, 6.00, 1.50)"));
  EXPECT_THAT(list, testing::Not(HasSubstr("seed 5")));
}

}  // namespace
}  // namespace gatefield::race
