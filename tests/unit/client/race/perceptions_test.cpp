#include "client/race/perceptions.h"

#include <gtest/gtest.h>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

TEST(Perceptions, ComparesTheSeedsThatAllHaveFlown) {
  const Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" seeds { first: 1 last: 5 } speed_m_s: 8 }
    cell { name: "field" }
    cell { name: "truth" beside: "field" perception: TRUE_POSE }
    cell { name: "alone" }
  )");
  std::vector<TrialResult> results;
  const auto add = [&](const Cell& cell, std::uint64_t seed, bool won) {
    results.push_back(result_of({&cell, 8, seed}));
    results.back().failure = won ? Failure::kNone : Failure::kTargetGate;
    results.back().cause = won ? Cause::kNone : Cause::kPerceptionWrong;
    results.back().belief_error_m = 0.5;
  };
  //                  seed 1 both won, 2 the field's fault, 3 control's, 4 the truth's bad luck, 5 not flown by both
  const bool field[] = {true, false, false, true, false}, truth[] = {true, true, false, false};
  for (std::uint64_t i = 0; i < 5; ++i) add(campaign.cells[0], i + 1, field[i]);
  for (std::uint64_t i = 0; i < 4; ++i) add(campaign.cells[1], i + 1, truth[i]);
  add(campaign.cells[2], 1, true);

  const auto table = perception_table(campaign, results);
  ASSERT_EQ(table.rows.size(), 1u);
  std::vector<std::string> row;
  for (const auto& cell : table.rows[0]) row.push_back(cell.text);
  // cell, speed, seeds, no vision, classical, learned, true pose, lost by perception, lost with both
  EXPECT_EQ(row[2], "4");
  EXPECT_EQ(row[5], "50");
  EXPECT_EQ(row[6], "50");
  EXPECT_EQ(row[7], "1");
  EXPECT_EQ(row[8], "1");
}

}  // namespace
}  // namespace gatefield::race
