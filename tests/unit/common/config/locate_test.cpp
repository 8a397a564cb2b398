#include "common/config/locate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/common/config/temporary_file.h"

namespace gatefield::config {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The working folder, until this goes.
class Standing {
 public:
  explicit Standing(const fs::path& in) : before_(fs::current_path()) { fs::current_path(in); }
  ~Standing() { fs::current_path(before_); }

 private:
  fs::path before_;
};

TEST(Locate, APathComesBeforeAShortName) {
  const TemporaryFile own("title: 'own'", "racer");
  const Standing standing(own.path().parent_path());
  EXPECT_EQ(find_config("vehicles", "racer").value(), "racer");
  EXPECT_EQ(find_config("vehicles", "heavy").value().filename(), "heavy.txt");
}

TEST(Locate, AFolderOfTheSameNameHidesNothingThatShips) {
  const TemporaryFile beside("");
  const Standing standing(beside.path().parent_path());
  fs::create_directory("racer");
  fs::create_directory("results");
  EXPECT_EQ(find_config("vehicles", "racer").value(), config_folder().value() / "vehicles/racer.txt");
  EXPECT_THAT(find_config("vehicles", "results").error(), HasSubstr("results: is a folder"));
  EXPECT_THAT(find_config("vehicles", "./racer").error(), HasSubstr("./racer: is a folder"));
}

TEST(Locate, WhatIsNotThereIsToldWithTheNamesThatAre) {
  EXPECT_THAT(find_config("vehicles", "nosuch").error(), HasSubstr("neither a file nor one of the vehicles"));
  EXPECT_THAT(find_config("vehicles", "nosuch").error(), HasSubstr("racer, racer-100g"));
  EXPECT_THAT(find_config("vehicles", "my/nosuch.txt").error(), HasSubstr("does not exist"));
}

}  // namespace
}  // namespace gatefield::config
