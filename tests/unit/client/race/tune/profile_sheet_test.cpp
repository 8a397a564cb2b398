#include "client/race/tune/profile_sheet.h"

#include <gmock/gmock.h>

#include "tests/unit/client/race/fixtures.h"
#include "tests/unit/client/race/tune/sheets.h"

namespace gatefield::race {
namespace {

using testing::HasSubstr;

TEST(ProfileSheet, ReadsNamesValuesRangesAndGivesTheSameTextBack) {
  const ProfileSheet sheet = sheet_of();
  EXPECT_EQ(sheet.name(), "lab");
  EXPECT_EQ(sheet.number("temperature"), 1.0);
  EXPECT_EQ(sheet.find("temperature")->min, 1e-6);
  EXPECT_EQ(sheet.number("rotors_yaw_sigma_rad_s3"), 9.0);
  EXPECT_EQ(sheet.find("rotors_yaw"), nullptr);
  EXPECT_FALSE(sheet.find("rates_by_changes")->has_range);
  EXPECT_FALSE(sheet.number("rates_by_changes").has_value()) << "no number";
  EXPECT_EQ(sheet.text(), kSheet);
}

TEST(ProfileSheet, WhatWasChangedSaysWhatItWas) {
  const ProfileSheet before = sheet_of();
  ProfileSheet after = before;
  after.rename("lab-tuned");
  after.set("rotors_yaw_sigma_rad_s3", "4.5");
  const std::string text = after.text(&before);
  EXPECT_THAT(text, HasSubstr("name: \"lab-tuned\"\n"));
  EXPECT_THAT(text, HasSubstr("s: 1.5  # 0 to 1000\nrotors_yaw_sigma_rad_s3: 4.5  # 0 to 1000, was 9\n"));
}

TEST(ProfileSheet, WhatIsNoProfileIsRefused) {
  EXPECT_THAT(ProfileSheet::parse("").error(), HasSubstr("has no name"));
  EXPECT_THAT(ProfileSheet::parse("temperature: 1\n").error(), HasSubstr("has no name"));
  for (const char* line : {"gatefield-server: what?  # 1 to x\n", "hello\n", "a: 1  # 2\n", "name: lab\n", ": 1\n"})
    EXPECT_THAT(ProfileSheet::parse("name: \"lab\"\n" + std::string(line)).error(),
                HasSubstr("is no line of a profile"))
        << line;
}

TEST(ProfileSheet, TheServersOwnSentenceIsTold) {
  const Folder folder;
  const auto program = folder.put("server", "#!/bin/sh\necho \"no profile '$4'\" >&2\nexit 2\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  EXPECT_THAT(read_profile(program.string(), "/profiles", "warp").error(),
              HasSubstr("the profile 'warp' is not to be had: no profile 'warp'"));
  folder.put("server", "#!/bin/sh\necho 'name: \"'$4'\"'\necho 'near_m: 4  # 0 to 50'\n");
  const auto sheet = read_profile(program.string(), "/profiles", "lab");
  ASSERT_TRUE(sheet.ok()) << sheet.error();
  EXPECT_EQ(sheet->number("near_m"), 4.0);
  EXPECT_FALSE(read_profile("/nowhere/server", "/profiles", "lab").ok());
}

}  // namespace
}  // namespace gatefield::race
