#include "server/planner/profile.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "server/planner/profile_file.h"

namespace gatefield::planner {
namespace {

std::filesystem::path write(const std::string& text) {
  auto file = std::filesystem::temp_directory_path() / ("gatefield-profile-" + std::to_string(::getpid()) + ".txt");
  std::ofstream(file) << text;
  return file;
}

TEST(Profile, EveryFieldOfTheTablesIsReadFromAFile) {
  std::string text = "name: 'all'\n";
  Profile expected;
  for (const IntegerField& field : kIntegerFields) {
    expected.*field.member = field.max;
    text += std::string(field.name) + ": " + std::to_string(field.max) + "\n";
  }
  for (const NumberField& field : kNumberFields) {
    // Apart from its neighbours, so that a name that stands for another member is seen; fields that come in order.
    const double value = std::string(field.name).ends_with("_min_m") ? field.min : field.max;
    expected.*field.member = value;
    text += std::string(field.name) + ": " + std::to_string(value) + "\n";
  }
  for (const SwitchField& field : kSwitchFields) {
    expected.*field.member = !(Profile{}.*field.member);
    text += std::string(field.name) + ": " + (expected.*field.member ? "true" : "false") + "\n";
  }
  const auto profile = load_profile(write(text));
  ASSERT_TRUE(profile.ok()) << profile.error();
  for (const IntegerField& field : kIntegerFields)
    EXPECT_EQ((*profile).*field.member, expected.*field.member) << field.name;
  for (const NumberField& field : kNumberFields)
    EXPECT_EQ((*profile).*field.member, expected.*field.member) << field.name;
  for (const SwitchField& field : kSwitchFields)
    EXPECT_EQ((*profile).*field.member, expected.*field.member) << field.name;
}

TEST(Profile, ItsTextHoldsEveryFieldAndGivesTheSameProfile) {
  Profile profile;
  profile.name = "quo\"ted";
  double odd = 1.0 / 3.0;
  for (const NumberField& field : kNumberFields) {
    odd = std::nextafter(odd, 1.0);
    if (!std::string(field.name).ends_with("_min_m")) profile.*field.member = field.min + odd * (field.max - field.min);
  }
  profile.field_fresh_s = 0.1 + 0.2;
  profile.temperature_min = 1e-6;
  profile.noise_sigma_n_s = {1.0 / 7.0, 2, 3, 1000};
  for (const SwitchField& field : kSwitchFields) profile.*field.member = !(Profile{}.*field.member);
  profile.progress_metric = ProgressMetric::kSquaredDistance;
  const std::string text = to_text(profile);
  EXPECT_NE(text.find("\ntemperature_min: 1e-06  # 1e-06 to 1000000\n"), std::string::npos) << text;
  const auto again = load_profile(write(text));
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(again->name, profile.name);
  EXPECT_EQ(again->noise_sigma_n_s, profile.noise_sigma_n_s);
  EXPECT_EQ(again->progress_metric, profile.progress_metric);
  for (const IntegerField& field : kIntegerFields) EXPECT_EQ((*again).*field.member, profile.*field.member);
  for (const SwitchField& field : kSwitchFields) EXPECT_EQ((*again).*field.member, profile.*field.member);
  for (const NumberField& field : kNumberFields) EXPECT_EQ((*again).*field.member, profile.*field.member) << field.name;
}

TEST(Profile, NoNameStandsTwiceInTheTables) {
  std::set<std::string> names{"name", "noise_sigma_n_s", "progress_metric"};
  const auto add = [&](const char* name) { EXPECT_TRUE(names.insert(name).second) << name; };
  for (const auto& field : kIntegerFields) add(field.name);
  for (const auto& field : kNumberFields) add(field.name);
  for (const auto& field : kSwitchFields) add(field.name);
}

TEST(Profile, DefaultsAreValid) { EXPECT_TRUE(validate(Profile{}).ok()) << validate(Profile{}).error(); }

TEST(Profile, EveryRangeIsHeldAndNamed) {
  for (const NumberField& field : kNumberFields) {
    Profile profile;
    profile.*field.member = field.max * 1.01 + 1;
    const Status status = validate(profile);
    ASSERT_FALSE(status.ok()) << field.name;
    EXPECT_EQ(status.failure().field, std::string("profile.") + field.name);
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
