#include "server/app/data_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace gatefield::app {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class DataFilesTest : public ::testing::Test {
 protected:
  DataFilesTest() : folder_(fs::temp_directory_path() / ("gatefield-data-files-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~DataFilesTest() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  fs::path folder_;
};

TEST_F(DataFilesTest, ShippedProfilesLoad) {
  const auto profiles = load_profiles(fs::path(GATEFIELD_SOURCE_DIR) / "deploy/config/profiles");
  ASSERT_TRUE(profiles.ok()) << profiles.error();
  EXPECT_EQ(profiles->count("race"), 1u);
  EXPECT_EQ(profiles->count("paper"), 1u);
}

TEST_F(DataFilesTest, EveryTextFileIsAProfile) {
  write("a.txt", "name: \"calm\" speed_limit_m_s: 3");
  write("b.txt", "name: \"quick\" speed_limit_m_s: 9");
  write("notes.md", "not a profile");
  const auto profiles = load_profiles(folder_);
  ASSERT_TRUE(profiles.ok()) << profiles.error();
  ASSERT_EQ(profiles->size(), 2u);
  EXPECT_EQ(profiles->at("calm").speed_limit_m_s, 3.0);
}

TEST_F(DataFilesTest, ErrorsNameTheFolderOrTheFile) {
  EXPECT_THAT(load_profiles(folder_ / "nowhere").error(), HasSubstr("nowhere"));
  EXPECT_THAT(load_profiles(folder_).error(), HasSubstr("no *.txt"));
  write("a.txt", "name: \"calm\"");
  write("b.txt", "name: \"calm\"");
  const auto twice = load_profiles(folder_);
  ASSERT_FALSE(twice.ok());
  EXPECT_THAT(twice.error(), HasSubstr("b.txt"));
  EXPECT_THAT(twice.error(), HasSubstr("a.txt"));
  write("b.txt", "name: \"quick\" samples: many");
  const auto broken = load_profiles(folder_);
  ASSERT_FALSE(broken.ok());
  EXPECT_THAT(broken.error(), HasSubstr("b.txt"));
}

TEST_F(DataFilesTest, ModelsLieBesideTheConfiguration) {
  fs::create_directories(folder_ / "config");
  fs::create_directories(folder_ / "models/mine");
  setenv("GATEFIELD_CONFIG", (folder_ / "config").c_str(), 1);
  const auto found = find_data_folder("models/mine", "--model FOLDER");
  unsetenv("GATEFIELD_CONFIG");
  ASSERT_TRUE(found.ok()) << found.error();
  EXPECT_EQ(*found, folder_ / "models/mine");
}

TEST_F(DataFilesTest, AMissingFolderIsNamedWithWhereItWasSought) {
  const auto found = find_data_folder("models/no-such-model", "--model FOLDER");
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(found.error(), HasSubstr("deploy/models/no-such-model"));
  EXPECT_THAT(found.error(), HasSubstr("--model FOLDER"));
}

}  // namespace
}  // namespace gatefield::app
