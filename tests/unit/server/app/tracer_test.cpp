#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/logging.h"
#include "common/trace/trace.h"
#include "server/app/trace.h"

namespace gatefield::app {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class Tracer : public ::testing::Test {
 protected:
  Tracer() {
    folder_ = fs::path(::testing::TempDir()) / ("trace-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    request_.vehicle = "drone";
  }
  ~Tracer() override { fs::remove_all(folder_); }
  std::string written() const {
    std::ostringstream text;
    text << std::ifstream(folder_ / "drone.trace").rdbuf();
    return text.str();
  }
  fs::path folder_;
  protocol::SessionRequest request_;
};

TEST_F(Tracer, WritesWhatIsBelievedNotWhatIsAimedAt) {
  auto tracer = make_tracer(request_, planner::Profile{}, {folder_, false});
  ASSERT_TRUE(tracer.ok()) << tracer.error();
  EXPECT_EQ(tracer.value()->rollouts(0), nullptr);
  planner::PlanInput input;
  input.start.p_WB = {1, 2, 3};
  input.field_age_s = 0.25;
  input.target.center_W = {9, 9, 9};
  planner::Plan plan;
  plan.lowest_field_m = 0.125;
  gates::GateBelief believed;
  believed.seen = true;
  believed.center_W = {4, 5, 6};
  believed.center_sigma_m = 0.5;
  tracer.value()->made({1500ms, 3, believed, input, plan});

  trace::Step expected;
  expected.stamp = 1500ms;
  expected.waypoint = 3;
  expected.seen = true;
  expected.p_W = {1, 2, 3};
  expected.center_W = {4, 5, 6};
  expected.center_sigma_m = 0.5;
  expected.axis_sigma_rad = 1.0;
  expected.field_age_s = 0.25;
  expected.lowest_field_m = 0.125;
  EXPECT_EQ(written(), trace::to_text(expected)) << "before the step's answer";
}

TEST_F(Tracer, LooksAtTheRolloutsOfEveryFifthStepWhenAsked) {
  auto tracer = make_tracer(request_, planner::Profile{}, {folder_, true});
  ASSERT_TRUE(tracer.ok());
  EXPECT_NE(tracer.value()->rollouts(0), nullptr);
  EXPECT_EQ(tracer.value()->rollouts(1), nullptr);
  EXPECT_NE(tracer.value()->rollouts(5), nullptr);
}

TEST_F(Tracer, AFullDiskIsToldOnceAndEndsTheTrace) {
  fs::create_symlink("/dev/full", folder_ / "drone.trace");
  auto tracer = make_tracer(request_, planner::Profile{}, {folder_, true});
  ASSERT_TRUE(tracer.ok()) << tracer.error();
  const planner::PlanInput input;
  const planner::Plan plan;
  const gates::GateBelief believed;
  ::testing::internal::CaptureStderr();
  log::start("tracer_test");
  for (int i = 0; i < 3; ++i) tracer.value()->made({1500ms, 3, believed, input, plan});
  const std::string said = ::testing::internal::GetCapturedStderr();
  const std::size_t first = said.find("drone.trace ends here, it can't be written: No space left");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("ends here", first + 20), std::string::npos) << said;
  EXPECT_EQ(tracer.value()->rollouts(0), nullptr) << "nothing is kept for it any more";
}

TEST_F(Tracer, AFolderThatIsNotThereIsAnError) {
  const auto tracer = make_tracer(request_, planner::Profile{}, {folder_ / "nowhere", false});
  ASSERT_FALSE(tracer.ok());
  EXPECT_EQ(tracer.failure().code, ErrorCode::kUnreadable);
  EXPECT_THAT(tracer.error(), ::testing::HasSubstr("drone.trace"));
}

}  // namespace
}  // namespace gatefield::app
