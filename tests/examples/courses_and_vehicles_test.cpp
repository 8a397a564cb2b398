// The files of docs/courses-and-vehicles.md, as the page shows them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>

#include "common/config/course.h"
#include "common/config/scenario.h"
#include "common/config/vehicle.h"
#include "tests/examples/page.h"

namespace gatefield::config {
namespace {

const std::filesystem::path kPage = std::filesystem::path(GATEFIELD_SOURCE_DIR) / "docs/courses-and-vehicles.md";

class CoursesAndVehicles : public testing::Test {
 protected:
  CoursesAndVehicles()
      : files_(test::shown_files(kPage)),
        folder_(std::filesystem::temp_directory_path() / ("gatefield-page-" + std::to_string(getpid()))) {
    test::write_files(files_, folder_);
  }
  ~CoursesAndVehicles() override { std::filesystem::remove_all(folder_); }

  /// The course of the page with one piece of text replaced.
  std::filesystem::path spoiled_course(const std::string& piece, const std::string& other) {
    std::string text = files_.at("my/hall.txt");
    const auto at = text.find(piece);
    EXPECT_NE(at, std::string::npos) << "the page's course has no '" << piece << "'";
    test::write_files({{"my/hall.txt", text.replace(at, piece.size(), other)}}, folder_);
    return folder_ / "my/hall.txt";
  }

  std::map<std::string, std::string> files_;
  std::filesystem::path folder_;
};

TEST_F(CoursesAndVehicles, TheCourseLoads) {
  const auto track = load_track(folder_ / "my/hall.txt");
  ASSERT_TRUE(track) << track.error();
  EXPECT_EQ(track->course.waypoints.size(), 2u);
  EXPECT_EQ(track->clutter.size(), 1u);
}

TEST_F(CoursesAndVehicles, TheVehicleLoads) {
  const auto vehicle = load_vehicle(folder_ / "my/heavy.txt");
  ASSERT_TRUE(vehicle) << vehicle.error();
  EXPECT_EQ(vehicle->quadrotor.mass_kg, 1.2);
}

TEST_F(CoursesAndVehicles, TheScenarioFindsBoth) {
  const auto scenario = load_scenario(folder_ / "my/windy.txt");
  ASSERT_TRUE(scenario) << scenario.error();
  EXPECT_EQ(scenario->seed, 7u);
  EXPECT_EQ(scenario->vehicle.quadrotor.mass_kg, 1.2);
}

TEST_F(CoursesAndVehicles, MistakesAreAnsweredAsThePageSays) {
  const std::string page = test::text_of(kPage);
  const auto promised = [&](const std::filesystem::path& file) {
    const auto track = load_track(file);
    ASSERT_FALSE(track);
    const std::string sentence =
        track.error().substr(folder_.string().size() + 1);  // the page's reader is in the folder
    EXPECT_NE(page.find('\n' + sentence + '\n'), std::string::npos) << "the page does not show: " << sentence;
  };
  promised(spoiled_course("inner_half_m", "inner_m"));
  promised(spoiled_course("start { position { x: -1 ", "start { position { x: 40 "));
}

}  // namespace
}  // namespace gatefield::config
