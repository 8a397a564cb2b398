#include "server/planner/profile.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "server/planner/profile.pb.h"
#include "server/planner/profile_fields.h"
#include "server/planner/profile_file.h"

namespace gatefield::planner {
namespace {

std::filesystem::path write(const std::string& text) {
  const auto file =
      std::filesystem::temp_directory_path() / ("gatefield-profile-" + std::to_string(::getpid()) + ".txt");
  std::ofstream(file) << text;
  return file;
}

TEST(Profile, EveryFieldOfTheSchemaIsRead) {
  std::set<std::string> known{"name", "noise_sigma_n_s", "progress_metric"};
  for (const auto& field : kIntegerFields) known.insert(field.name);
  for (const auto& field : kNumberFields) known.insert(field.name);
  for (const auto& field : kSwitchFields) known.insert(field.name);
  const auto* schema = ProfileConfig::descriptor();
  EXPECT_EQ(static_cast<std::size_t>(schema->field_count()), known.size());
  for (int i = 0; i < schema->field_count(); ++i)
    EXPECT_TRUE(known.contains(schema->field(i)->name())) << schema->field(i)->name();
}

TEST(Profile, DefaultsAreValid) { EXPECT_TRUE(validate(Profile{}).ok()) << validate(Profile{}).error(); }

TEST(Profile, EveryRangeIsHeldAndNamed) {
  for (const NumberField& field : kNumberFields) {
    Profile profile;
    profile.*field.member = field.max * 1.01 + 1;
    const Status status = validate(profile);
    ASSERT_FALSE(status.ok()) << field.name;
    EXPECT_NE(status.error().find(std::string("profile.") + field.name), std::string::npos) << status.error();
    profile.*field.member = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(validate(profile).ok()) << field.name;
  }
}

TEST(Profile, TheShippedOnesLoad) {
  for (const char* name : {"race", "paper"}) {
    const auto profile = load_profile(std::filesystem::path(GATEFIELD_SOURCE_DIR) / "deploy/config/profiles" /
                                      (std::string(name) + ".txt"));
    ASSERT_TRUE(profile.ok()) << profile.error();
    EXPECT_EQ(profile->name, name);
  }
}

TEST(Profile, WhatAFileSaysIsTakenAndTheRestStaysDefault) {
  const auto profile = load_profile(write(
      "name: \"mine\" samples: 512 funnel: false noise_sigma_n_s: [1, 2, 3, 4] progress_metric: SQUARED_DISTANCE"));
  ASSERT_TRUE(profile.ok()) << profile.error();
  EXPECT_EQ(profile->samples, 512);
  EXPECT_FALSE(profile->funnel);
  EXPECT_EQ(profile->noise_sigma_n_s[3], 4.0);
  EXPECT_EQ(profile->progress_metric, ProgressMetric::kSquaredDistance);
  EXPECT_EQ(profile->steps, Profile{}.steps);
}

TEST(Profile, MistakesAreNamedWithTheirPlace) {
  const auto unknown = load_profile(write("name: \"x\"\nsampels: 512\n"));
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().find(":2"), std::string::npos) << unknown.error();
  EXPECT_NE(unknown.error().find("sampels"), std::string::npos) << unknown.error();

  const auto odd = load_profile(write("name: \"x\" samples: 100"));
  ASSERT_FALSE(odd.ok());
  EXPECT_NE(odd.error().find("multiple of 16"), std::string::npos) << odd.error();

  const auto noise = load_profile(write("name: \"x\" noise_sigma_n_s: [1, 2]"));
  ASSERT_FALSE(noise.ok());
  EXPECT_NE(noise.error().find("expected 4"), std::string::npos) << noise.error();
}

}  // namespace
}  // namespace gatefield::planner
