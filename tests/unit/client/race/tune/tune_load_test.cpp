#include <gmock/gmock.h>

#include "client/race/tune/tune.h"
#include "common/config/locate.h"
#include "tests/unit/client/race/fixtures.h"
#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

const std::string kRaces =
    "races { cell { name: 'a' scenario: 'circle' speed_m_s: [6, 8] laps: 1 seeds { first: 1 last: 40 } } }\n";

Result<Tune> load(const std::string& text, const TuneOrder& order = {}) {
  const Folder folder;
  return load_tune(folder.put("t.txt", text), order);
}
std::string refusal(const std::string& text, const TuneOrder& order = {}) {
  const auto tune = load(text, order);
  return tune.ok() ? "" : tune.error();
}

TEST(TuneFile, WhatIsNotSaidHasADefault) {
  const auto tune = load(kRaces + "trials: 300");
  ASSERT_TRUE(tune.ok()) << tune.error();
  EXPECT_EQ(tune->title, "t");
  EXPECT_EQ(tune->base_profile, "race");
  EXPECT_EQ(tune->seeds_per_generation, 4u);
  EXPECT_EQ(tune->fresh_seeds.first, 41u);
  EXPECT_EQ(tune->fresh_seeds.last, 60u);
  EXPECT_EQ(tune->races_per_seed(), 2u);
  EXPECT_FALSE(tune->candidates || tune->budget.minutes);
  EXPECT_EQ(tune->budget.trials, 300u);
}

TEST(TuneFile, ThePersonsBudgetStandsInPlaceOfTheFiles) {
  const TuneOrder order{.budget = {.trials = {}, .minutes = 5.0}};
  const auto tune = load(kRaces + "trials: 300", order);
  ASSERT_TRUE(tune.ok()) << tune.error();
  EXPECT_EQ(tune->budget.minutes, 5.0);
  EXPECT_FALSE(tune->budget.trials);
  EXPECT_THAT(refusal(kRaces), HasSubstr("there is no budget, expected trials or minutes"));
}

TEST(TuneFile, EvaluationSeedsAreRefusedUnlessToldOtherwise) {
  const std::string on_them =
      "races { cell { name: 'a' scenario: 'circle' speed_m_s: 6 seeds { first: 990 last: 1001 } } }\ntrials: 300\n";
  EXPECT_THAT(refusal(on_them),
              HasSubstr("t.txt:1: cell 'a': seeds is 990 to 1001, expected seeds of the lab, 1 to 1000"));
  EXPECT_EQ(refusal(on_them, {.budget = {}, .evaluation_seeds = true}), "");
  const std::string fresh = kRaces + "trials: 300\nfresh_seeds { first: 1001 last: 1020 }";
  EXPECT_THAT(refusal(fresh), HasSubstr("t.txt:3: fresh_seeds is 1001 to 1020, expected seeds of the lab"));
  EXPECT_EQ(refusal(fresh, {.budget = {}, .evaluation_seeds = true}), "");
}

TEST(TuneFile, BadFilesGetSentences) {
  const auto with = [](const std::string& more) { return refusal(kRaces + "trials: 300\n" + more); };
  EXPECT_THAT(with("candidates: 4"), HasSubstr("t.txt:3: candidates is 4, expected 5 to 200"));
  EXPECT_THAT(with("spread: 3"), HasSubstr("t.txt:3: spread is 3, expected 0.01 to 1"));
  EXPECT_THAT(with("seeds_per_generation: 0"), HasSubstr("seeds_per_generation is 0, expected 1 to 1000"));
  EXPECT_THAT(with("seeds_per_generation: 41"), HasSubstr("seeds is 1 to 40, expected at least 41 of them"));
  EXPECT_THAT(with("fresh_seeds { first: 30 last: 50 }"), HasSubstr("expected none of those of cell 'a', 1 to 40"));
  EXPECT_THAT(with("fresh_seeds { first: 50 last: 45 }"), HasSubstr("expected first <= last"));
  EXPECT_THAT(with("minutes: 0"), HasSubstr("minutes is 0, expected 1 to 100000"));
  EXPECT_THAT(with("warp: 9"), HasSubstr("unknown field 'warp'"));
  EXPECT_THAT(refusal("trials: 300"), HasSubstr("'races' is missing"));
  EXPECT_THAT(refusal("races { }\ntrials: 300"), HasSubstr("there are 0 cells"));
  EXPECT_THAT(refusal("trials: 3\nraces { defaults { profile: 'x' }\n cell { name: 'a' scenario: 'circle' speed_m_s: 6 "
                      "seeds { first: 1 last: 9 } } }"),
              HasSubstr("profile is set, expected none"));
  EXPECT_THAT(
      refusal("trials: 3\nraces {\n cell { name: 'a' scenario: 'circle' speed_m_s: 99 seeds { first: 1 last: 9 } } }"),
      HasSubstr("t.txt:3: cell 'a': speed_m_s is 99"));
  EXPECT_THAT(refusal("trials: 3\nraces { defaults { scenario: 'circle' speed_m_s: 6 seeds { first: 1 last: 9 } }\n"
                      "cell { name: 'a' } cell { name: 'b' vehicle: 'racer-rates' } }"),
              HasSubstr("driven in another way than that of cell 'a'"));
}

TEST(TuneFile, FieldsHaveRangesAroundTheBaseUnlessTold) {
  const auto tune = load(kRaces +
                         "trials: 300 field { name: 'temperature' } field { name: 'rotors_yaw_sigma_rad_s3' max: 12 }\n"
                         "field { name: 'crossing_weight' min: 0 max: 100 } field { name: 'unseen_speed_factor' min: "
                         "0.2 max: 1 scale: LINEAR }");
  ASSERT_TRUE(tune.ok()) << tune.error();
  const auto space = space_of(*tune, sheet_of());
  ASSERT_TRUE(space.ok()) << space.error();
  const auto& d = space->dimensions();
  EXPECT_DOUBLE_EQ(d[0].min, 0.25);
  EXPECT_DOUBLE_EQ(d[0].max, 4.0);
  EXPECT_TRUE(d[0].logarithmic);
  EXPECT_DOUBLE_EQ(d[1].min, 2.25);
  EXPECT_DOUBLE_EQ(d[1].max, 12.0);
  EXPECT_FALSE(d[2].logarithmic) << "0 has no logarithm";
  EXPECT_FALSE(d[3].logarithmic);

  const auto zero = load(kRaces + "trials: 300 field { name: 'crossing_weight' }");
  EXPECT_THAT(space_of(*zero, sheet_of()).error(),
              HasSubstr("field 'crossing_weight': the base has 0, expected min and max"));
  const auto unknown = load(kRaces + "trials: 300 field { name: 'warp' }");
  EXPECT_THAT(space_of(*unknown, sheet_of()).error(), HasSubstr("field 'warp': is no number of the profile 'lab'"));
  const auto usual = load(kRaces + "trials: 300");
  EXPECT_EQ(space_of(*usual, sheet_of())->dimensions().front().name, "temperature");
}

TEST(TuneFile, ThoseThatShipAreRead) {
  const auto folder = config::config_folder();
  ASSERT_TRUE(folder.ok());
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "tunes")) {
    const auto tune = load_tune(entry.path());
    EXPECT_TRUE(tune.ok()) << tune.error();
    ++files;
  }
  EXPECT_GE(files, 2);
}

}  // namespace
}  // namespace gatefield::race
