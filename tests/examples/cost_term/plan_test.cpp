// The term of docs/adding-a-cost-term.md in the planner that the page's changes make: read from a profile's file,
// checked, and acting.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "server/planner/planner.h"
#include "server/planner/profile_file.h"

namespace gatefield::planner {
namespace {

Result<Profile> read(const std::string& text) {
  const auto file =
      std::filesystem::temp_directory_path() / ("gatefield-cost-term-" + std::to_string(::getpid()) + ".txt");
  std::ofstream(file) << text;
  auto profile = load_profile(file);
  std::filesystem::remove(file);
  return profile;
}

/// Largest tilt of a plan that wants to be fast, towards a far gate.
double largest_tilt_rad(const Profile& profile) {
  QuadrotorState state;
  state.p_WB = {0, 0, 1.5};
  state.thrust_n = state.thrust_command_n = hover_thrust_n(QuadrotorModel{});
  Course course;
  course.waypoints = {{{40, 0, 1.5}, {1, 0, 0}}};
  auto planner = Planner::create(profile, QuadrotorModel{}, course, kGuideConeAngle_rad, 1);
  EXPECT_TRUE(planner.ok());
  PlanInput input;
  input.start = state;
  input.target.center_W = {40, 0, 1.5};
  Plan plan;
  double largest_rad = 0.0;
  for (std::uint64_t step = 0; step < 40; ++step) {
    input.step = step;
    input.elapsed_s = step > 0 ? 0.03 : 0.0;
    planner.value()->plan(input, &plan);
    input.start = plan.state[0];
    const Eigen::Vector3d up_W = input.start.q_WB * Eigen::Vector3d::UnitZ();
    largest_rad = std::max(largest_rad, std::acos(std::clamp(up_W.z(), -1.0, 1.0)));
  }
  return largest_rad;
}

TEST(CostTermExample, TheWeightInAProfilesFileMakesPlansTiltLess) {
  const std::string text = "name: 'mine' samples: 512 speed_limit_m_s: 15 ";
  const auto without = read(text), with = read(text + "tilt_weight: 100 tilt_limit_rad: 0.35");
  ASSERT_TRUE(without.ok() && with.ok());
  EXPECT_GT(largest_tilt_rad(*without), 0.6);
  EXPECT_LT(largest_tilt_rad(*with), 0.45);
}

TEST(CostTermExample, ItsRangeIsCheckedAndNamed) {
  const auto profile = read("name: 'mine' tilt_limit_rad: 4");
  ASSERT_FALSE(profile.ok());
  EXPECT_EQ(profile.failure().field, "profile.tilt_limit_rad");
}

}  // namespace
}  // namespace gatefield::planner
