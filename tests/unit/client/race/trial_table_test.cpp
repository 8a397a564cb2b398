#include "client/race/trial_table.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/client/race/fixtures.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

TEST(TrialLine, ComesBackAsItWas) {
  const Campaign campaign = campaign_of(kTwoCells);
  TrialResult result = result_of({&campaign.cells[1], 7.25, 6});
  result.sentence = "said \"this\", and that\nin two lines";
  result.setup = 0xfedcba9876543210ull;
  result.hull = "sphere";
  result.retries = 3;
  result.median_lap_s = 2.5;
  result.slowest_lap_s = 3.25;
  result.clearance_m = std::nan("");
  result.cause = Cause::kPerceptionWrong;
  result.belief_error_m = 0.375;
  result.seen_before_s = std::nan("");
  result.missed = 2;
  result.clearances_m = {0.25, 0.0625};
  const auto again = parse_csv_line(csv_line(result));
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(csv_line(*again), csv_line(result));
  EXPECT_EQ(again->sentence, "said \"this\", and that in two lines");
  EXPECT_EQ(again->failure, Failure::kPassedBeside);
  EXPECT_EQ(again->cause, Cause::kPerceptionWrong);
  EXPECT_DOUBLE_EQ(again->belief_error_m, 0.375);
  EXPECT_TRUE(std::isnan(again->seen_before_s));
  EXPECT_EQ(again->setup, result.setup);
  EXPECT_EQ(again->flight, result.flight);
  EXPECT_TRUE(std::isnan(again->clearance_m));
  EXPECT_EQ(again->missed, 2);
  EXPECT_EQ(again->retries, 3);
  EXPECT_EQ(again->hull, "sphere");
  EXPECT_EQ(again->clearances_m, result.clearances_m);
  EXPECT_DOUBLE_EQ(again->median_lap_s, 2.5);
  EXPECT_DOUBLE_EQ(again->slowest_lap_s, 3.25);
  EXPECT_EQ(trial_name(*again), "b at 7.25 m/s, seed 6");
  const std::string header = csv_header();
  EXPECT_EQ(std::count(header.begin(), header.end(), ','), 41);
}

TEST(TrialLine, WhatIsWrongIsNamed) {
  const Campaign campaign = campaign_of(kTwoCells);
  const std::string line = csv_line(result_of({&campaign.cells[0], 6, 7}));
  EXPECT_THAT(parse_csv_line("a,b").error(), HasSubstr("2 columns, expected 42"));
  std::string bad = line;
  bad.replace(bad.find(",7,"), 3, ",x,");
  EXPECT_THAT(parse_csv_line(bad).error(), HasSubstr("seed is 'x'"));
  EXPECT_EQ(parse_csv_line(bad).failure().field, "seed");
  bad = line;
  bad.replace(bad.find(",won,"), 5, ",owned,");
  EXPECT_THAT(parse_csv_line(bad).error(), HasSubstr("failure is 'owned'"));
  TrialResult near = result_of({&campaign.cells[0], 6, 7});
  near.clearances_m = {0.4321};
  bad = csv_line(near);
  bad.replace(bad.find("0.4321"), 6, "0.4 x2");
  EXPECT_THAT(parse_csv_line(bad).error(), HasSubstr("clearances_m is '0.4 x2'"));
}

}  // namespace
}  // namespace gatefield::race
