#include "common/trace/trace.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>

namespace gatefield::trace {
namespace {

using testing::HasSubstr;

class TraceFile : public testing::Test {
 protected:
  ~TraceFile() override { std::filesystem::remove(file_); }
  Result<std::vector<Step>> read_back(const std::string& text) {
    std::ofstream(file_, std::ios::binary) << text;
    return read(file_);
  }
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("gatefield-trace-" + std::to_string(getpid()));
};

Step some_step() {
  Step step;
  step.stamp = std::chrono::milliseconds(10'020);
  step.waypoint = 3;
  step.seen = true;
  step.p_W = {1, -2, 1.5};
  step.center_W = {6.25, 0.5, 1.5};
  step.axis_W = {0, 1, 0};
  step.center_sigma_m = 0.05;
  step.axis_sigma_rad = 0.125;
  step.field_age_s = 0.25;
  step.lowest_field_m = -0.5;
  return step;
}

TEST_F(TraceFile, ReadsBackWhatWasWritten) {
  Step with_rollouts = some_step();
  with_rollouts.hold = true;
  with_rollouts.rollouts = {{{{1, 2, 3}, {4, 5, 6}}, {0.5, std::numeric_limits<double>::quiet_NaN()}}};
  const auto steps = read_back(to_text(some_step()) + to_text(with_rollouts));
  ASSERT_TRUE(steps.ok()) << steps.error();
  ASSERT_EQ(steps->size(), 2u);
  const Step &first = (*steps)[0], &second = (*steps)[1];
  EXPECT_EQ(first.stamp, some_step().stamp);
  EXPECT_EQ(first.waypoint, 3u);
  EXPECT_TRUE(first.seen);
  EXPECT_FALSE(first.hold);
  EXPECT_EQ(first.p_W, some_step().p_W);
  EXPECT_EQ(first.center_W, some_step().center_W);
  EXPECT_EQ(first.axis_W, some_step().axis_W);
  EXPECT_DOUBLE_EQ(first.axis_sigma_rad, 0.125);
  EXPECT_DOUBLE_EQ(first.field_age_s, 0.25);
  EXPECT_DOUBLE_EQ(first.lowest_field_m, -0.5);
  EXPECT_TRUE(first.rollouts.empty());
  EXPECT_TRUE(second.hold);
  ASSERT_EQ(second.rollouts.size(), 1u);
  ASSERT_EQ(second.rollouts[0].p_W.size(), 2u);
  EXPECT_EQ(second.rollouts[0].p_W[1], Eigen::Vector3d(4, 5, 6));
  EXPECT_DOUBLE_EQ(second.rollouts[0].field_m[0], 0.5);
  EXPECT_TRUE(std::isnan(second.rollouts[0].field_m[1]));
}

TEST_F(TraceFile, AnUnfinishedLineIsNotThereAndAWrongOneIsNamed) {
  const std::string line = to_text(some_step());
  const auto cut = read_back(line + line.substr(0, 20));
  ASSERT_TRUE(cut.ok()) << cut.error();
  EXPECT_EQ(cut->size(), 1u);
  const std::string zeros = " 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n";
  for (const std::string& wrong :
       {std::string("step 1 2\n"), std::string("rollout 1 2 3\n"), std::string("what\n"), std::string("step a b c\n"),
        std::string("\n"), "step 1e300 0" + zeros, "step nan 0" + zeros, "step -1 0" + zeros, "step 1 -1" + zeros,
        "step 1 1e300" + zeros}) {
    const auto bad = read_back(line + wrong);
    ASSERT_FALSE(bad.ok()) << wrong;
    EXPECT_THAT(bad.error(), HasSubstr(":2:"));
  }
  EXPECT_THAT(read("/nowhere/x.trace").error(), HasSubstr("/nowhere/x.trace"));
}

}  // namespace
}  // namespace gatefield::trace
