#include "client/race/tune/comparison.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

/// Pairs of a kind: won by whom, and the scores.
void add(std::vector<Pair>* pairs, int count, bool base_won, bool found_won, double base_score, double found_score) {
  Pair pair;
  pair.base.failure = base_won ? Failure::kNone : Failure::kTimeout;
  pair.found.failure = found_won ? Failure::kNone : Failure::kTimeout;
  pair.base_score = base_score;
  pair.found_score = found_score;
  pairs->insert(pairs->end(), static_cast<std::size_t>(count), pair);
}

TEST(Verdict, WinningMoreOftenIsBetterWhateverTheClearance) {
  std::vector<Pair> pairs;
  add(&pairs, 6, false, true, 0.2, 1.1);
  add(&pairs, 10, true, true, 1.4, 1.2);
  const Verdict said = verdict(pairs);
  EXPECT_TRUE(said.better);
  EXPECT_THAT(said.sentence,
              HasSubstr("is better: it wins more often; of 16 races, 6 were won by the found profile alone "
                        "and 0 by the base alone (p 0.031)"));
}

TEST(Verdict, WinningLessOftenIsWorse) {
  std::vector<Pair> pairs;
  add(&pairs, 7, true, false, 1.2, 0.1);
  add(&pairs, 1, false, true, 0.1, 1.5);
  add(&pairs, 20, true, true, 1.0, 1.5);
  EXPECT_FALSE(verdict(pairs).better);
  add(&pairs, 3, true, false, 1.2, 0.1);
  EXPECT_THAT(verdict(pairs).sentence, HasSubstr("WORSE: it wins less often"));
}

TEST(Verdict, ClearanceAndTimeDecideWhereWinningDoesNot) {
  std::vector<Pair> pairs;
  add(&pairs, 8, true, true, 1.2, 1.3);
  add(&pairs, 3, true, true, 1.2, 1.2);
  EXPECT_TRUE(verdict(pairs).better);
  EXPECT_THAT(verdict(pairs).sentence, HasSubstr("no less often, with more clearance or sooner"));
  add(&pairs, 1, true, false, 1.2, 0.3);
  EXPECT_FALSE(verdict(pairs).better) << "one race was lost";
  pairs.clear();
  add(&pairs, 8, true, true, 1.3, 1.2);
  EXPECT_THAT(verdict(pairs).sentence, HasSubstr("WORSE: it wins no more often, with less clearance or later"));
}

TEST(Verdict, WhatIsNotShownIsSaid) {
  std::vector<Pair> pairs;
  EXPECT_THAT(verdict(pairs).sentence, HasSubstr("NOT shown to be better"));
  add(&pairs, 3, false, true, 0.2, 1.1);
  add(&pairs, 5, true, true, 1.2, 1.3);
  EXPECT_FALSE(verdict(pairs).better);
  EXPECT_THAT(verdict(pairs).sentence, HasSubstr("NOT shown to be better than the base"));
}

TEST(Comparison, PairsAreOfTheSameRaceAndTheTableHasBoth) {
  Campaign campaign = campaign_of(R"(
    defaults { scenario: "circle" laps: 1 }
    cell { name: "a-base" speed_m_s: [6, 8] seeds { first: 5 last: 8 } profile: "lab" }
    cell { name: "a-found" speed_m_s: [6, 8] seeds { first: 5 last: 8 } profile: "lab-tuned" }
    cell { name: "a-b-found" speed_m_s: 6 seeds { first: 5 last: 8 } profile: "lab-tuned" }
  )");
  std::vector<TrialResult> results;
  for (const Trial& trial : trials_of(campaign)) results.push_back(result_of(trial));
  const std::vector<Pair> pairs = pairs_of(campaign, results);
  ASSERT_EQ(pairs.size(), 8u) << "a-b has no base";
  for (const Pair& pair : pairs) {
    EXPECT_EQ(pair.base.cell, "a-base");
    EXPECT_EQ(pair.found.cell, "a-found");
    EXPECT_EQ(pair.base.seed, pair.found.seed);
    EXPECT_EQ(pair.base.speed_m_s, pair.found.speed_m_s);
  }
  const std::string table = plot::to_csv(comparison_of(campaign, results));
  EXPECT_THAT(table, HasSubstr("lab-tuned,6,4,3,30.06")) << "seed 6 loses; 3 of 4";
}

}  // namespace
}  // namespace gatefield::race
