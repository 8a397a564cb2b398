#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "client/simulator/belief_picture.h"
#include "client/simulator/canvas.h"
#include "client/simulator/depth_picture.h"
#include "client/simulator/flight_picture.h"
#include "client/simulator/simulation.h"
#include "common/config/frame.h"
#include "common/config/locate.h"
#include "tests/support/path_follower.h"

namespace gatefield::simulator {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Outputs : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scenario_ =
        new config::Scenario(config::load_scenario(config::find_config("scenarios", "circle-0.3m").value()).value());
    scenario_->track.course.laps = 1;
    const auto world = config::perturbed_world(scenario_->track, scenario_->perturbation, scenario_->seed);
    test::PathFollower client(world, scenario_->vehicle.quadrotor, {});
    const std::atomic<bool> stop{false};
    report_ = new Report(fly(*scenario_, {}, &client, stop).value());
  }
  static void TearDownTestSuite() {
    delete scenario_;
    delete report_;
  }
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gatefield-outputs-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static config::Scenario* scenario_;
  static Report* report_;
  std::filesystem::path folder_;
};
config::Scenario* Outputs::scenario_ = nullptr;
Report* Outputs::report_ = nullptr;

std::size_t colors_in(const cv::Mat& picture) {
  std::set<int> colors;
  for (int v = 0; v < picture.rows; ++v)
    for (int u = 0; u < picture.cols; ++u) {
      const auto& p = picture.at<cv::Vec3b>(v, u);
      colors.insert(p[0] << 16 | p[1] << 8 | p[2]);
    }
  return colors.size();
}

TEST_F(Outputs, TheFlightPictureShowsThePath) {
  const auto file = folder_ / "flight.png";
  ASSERT_TRUE(write_flight_picture(file, *scenario_, *report_, "seed 1").ok());
  const cv::Mat with_path = cv::imread(file.string());
  ASSERT_FALSE(with_path.empty());
  EXPECT_EQ(with_path.cols, 1800);
  EXPECT_EQ(with_path.rows, 1000);
  EXPECT_GT(colors_in(with_path), 200u);

  Report without = *report_;
  without.samples.clear();
  ASSERT_TRUE(write_flight_picture(file, *scenario_, without, "seed 1").ok());
  cv::Mat difference;
  cv::absdiff(with_path, cv::imread(file.string()), difference);
  EXPECT_GT(cv::countNonZero(difference.reshape(1)), 5000) << "the path leaves no trace";
}

TEST_F(Outputs, ARaceThatEndsAtOnceStillGivesAPicture) {
  Report nothing;
  nothing.sentence = "interrupted";
  nothing.outcome = Outcome::kInterrupted;
  EXPECT_TRUE(write_flight_picture(folder_ / "nothing.png", *scenario_, nothing, "").ok());
  EXPECT_FALSE(cv::imread((folder_ / "nothing.png").string()).empty());
}

TEST_F(Outputs, AGateThatIsPassedTwiceIsDrawn) {
  const auto scenario = config::load_scenario(config::find_config("scenarios", "there-and-back").value());
  ASSERT_TRUE(scenario.ok()) << scenario.error();
  Report lost;
  lost.sentence = "touched the frame of gate 3";
  lost.outcome = Outcome::kTouchedGate;
  lost.culprit = 2;
  EXPECT_TRUE(write_flight_picture(folder_ / "twice.png", *scenario, lost, "").ok());
  EXPECT_TRUE(write_end_picture(folder_ / "end.png", *scenario, lost, {}, lost.culprit, "", "").ok());
  EXPECT_GT(colors_in(cv::imread((folder_ / "twice.png").string())), 20u);
}

TEST_F(Outputs, SeveralFlightsShareAPicture) {
  FlownPath one{1, true, {}};
  for (const auto& sample : report_->samples)
    one.points.push_back({sample.t_s, sample.state.p_WB, sample.state.v_WB.norm()});
  FlownPath other = one;
  other.seed = 2;
  other.won = false;
  other.points.resize(other.points.size() / 2);
  const auto file = folder_ / "flights.png";
  ASSERT_TRUE(write_flights_picture(file, *scenario_, {one}, "one", "").ok());
  const cv::Mat alone = cv::imread(file.string());
  ASSERT_TRUE(write_flights_picture(file, *scenario_, {one, other}, "one", "").ok());
  cv::Mat difference;
  cv::absdiff(alone, cv::imread(file.string()), difference);
  EXPECT_GT(colors_in(alone), 200u);
  EXPECT_GT(cv::countNonZero(difference.reshape(1)), 1000) << "the second flight's gates leave no trace";
  EXPECT_TRUE(write_flights_picture(file, *scenario_, {}, "none", "").ok());
}

TEST_F(Outputs, RolloutsAreDrawnRedWhereTheFieldSaysCollisionAndGreenWhereFree) {
  const auto world = config::perturbed_world(scenario_->track, scenario_->perturbation, scenario_->seed);
  std::vector<trace::Step> trace;
  for (std::size_t i = 0; i < 100 && i < report_->samples.size(); i += 5) {
    trace::Step step;
    step.stamp = kLockstepEpoch + from_seconds(report_->samples[i].t_s);
    step.p_W = report_->samples[i].state.p_WB;
    step.center_W = world.gates[0].X_WG.translation();
    step.axis_W = world.gates[0].X_WG.linear().col(0);
    step.seen = true;
    for (const double side : {-1.0, 1.0}) {
      trace::Rollout rollout;
      for (int k = 1; k <= 10; ++k) {
        rollout.p_W.emplace_back(step.p_W + 0.1 * k * Eigen::Vector3d(side, 0.3, 0));
        rollout.field_m.push_back(side);
      }
      step.rollouts.push_back(rollout);
    }
    trace.push_back(step);
  }
  const auto count = [&](const std::string& name) {
    const cv::Mat picture = cv::imread((folder_ / name).string());
    std::pair<int, int> pixels;
    for (int v = 0; v < picture.rows; ++v)
      for (int u = 0; u < picture.cols * 9 / 10; ++u) {  // not the colour bar
        const auto& p = picture.at<cv::Vec3b>(v, u);
        pixels.first += p[2] > 150 && p[1] < 100 && p[0] < 100;
        pixels.second += p[1] > 90 && p[2] < 90 && p[0] < 60;
      }
    return pixels;
  };
  for (const auto& [name, write] :
       {std::pair("all.png", &write_rollouts_picture), std::pair("approach.png", &write_approach_picture)}) {
    ASSERT_TRUE(write(folder_ / name, *scenario_, *report_, trace, "Title", "subtitle").ok());
    EXPECT_GT(count(name).first, 30) << name;
    EXPECT_GT(count(name).second, 30) << name;
  }
  ASSERT_TRUE(write_end_picture(folder_ / "end.png", *scenario_, *report_, trace, 0, "Title", "subtitle").ok());
  EXPECT_GT(colors_in(cv::imread((folder_ / "end.png").string())), 20u);
  EXPECT_FALSE(write_end_picture("/proc/nowhere/x.png", *scenario_, *report_, {}, -1, "", "").ok());
}

TEST_F(Outputs, TheDepthPictureIsNotBlank) {
  ASSERT_TRUE(report_->snapshot);
  const auto file = folder_ / "depth.png";
  ASSERT_TRUE(write_depth_picture(file, *report_->snapshot, "depth").ok());
  EXPECT_GT(colors_in(cv::imread(file.string())), 100u);
}

TEST_F(Outputs, ASavedFrameReadsBackAndShowsTheGateWhereItIs) {
  const auto world = config::perturbed_world(scenario_->track, scenario_->perturbation, scenario_->seed);
  ASSERT_TRUE(report_->snapshot);
  ASSERT_TRUE(save_frame(folder_ / "frame", *report_->snapshot).ok());
  const auto frame = config::load_frame(folder_ / "frame" / "frame.txt");
  ASSERT_TRUE(frame.ok()) << frame.error();
  ASSERT_TRUE(frame->gate);
  EXPECT_TRUE(
      frame->gate->X_WG.isApprox(world.gates[static_cast<std::size_t>(report_->snapshot->waypoint)].X_WG, 1e-9));
  EXPECT_TRUE(frame->X_WC.isApprox(report_->snapshot->X_WC, 1e-9));
  const Eigen::Vector3d p_CG = frame->X_WC.inverse() * frame->gate->X_WG.translation();
  EXPECT_TRUE(frame->camera.sees(p_CG)) << "the kept frame has no gate in it";
  EXPECT_GT(p_CG.z(), 2.0);
  EXPECT_LT(p_CG.z(), 5.0);
  // The middle of a post must be about as far as the geometry says.
  const cv::Mat depth = cv::imread(frame->depth_file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_16UC1);
  ASSERT_EQ(depth.cols, 160);
  int right = 0, looked_at = 0;
  for (const double z : {-0.3, -0.1, 0.1, 0.3})
    for (const double side : {-0.625, 0.625}) {
      const Eigen::Vector3d p_C = frame->X_WC.inverse() * frame->gate->X_WG * Eigen::Vector3d(-0.03, side, z);
      if (!frame->camera.sees(p_C)) continue;
      const auto u = static_cast<int>(frame->camera.fx_px * p_C.x() / p_C.z() + frame->camera.cx_px);
      const auto v = static_cast<int>(frame->camera.fy_px * p_C.y() / p_C.z() + frame->camera.cy_px);
      ++looked_at;
      right += std::abs(depth.at<std::uint16_t>(v, u) * 1e-3 - p_C.z()) < 0.3;
    }
  EXPECT_GE(looked_at, 4);
  EXPECT_GE(2 * right, looked_at);
}

TEST_F(Outputs, TheTableHasALinePerSampleAndAsManyColumnsAsItsHeader) {
  const auto file = folder_ / "new" / "run.csv";
  ASSERT_TRUE(write_csv(file, *report_).ok());
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  EXPECT_THAT(line, StartsWith("t_s,px_m,"));
  const auto commas = std::count(line.begin(), line.end(), ',');
  std::size_t lines = 0;
  for (; std::getline(in, line); ++lines) ASSERT_EQ(std::count(line.begin(), line.end(), ','), commas) << line;
  EXPECT_EQ(lines, report_->samples.size());
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".part"));
}

TEST_F(Outputs, APlaceThatCantBeWrittenIsTold) {
  const auto status = write_csv("/proc/nowhere/run.csv", *report_);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("/proc/nowhere/run.csv"));
}

TEST(Ticks, AreRoundAndFew) {
  EXPECT_DOUBLE_EQ(tick_step(10, 6), 2);
  EXPECT_DOUBLE_EQ(tick_step(0.9, 6), 0.2);
  EXPECT_DOUBLE_EQ(tick_step(24, 12), 2);
  EXPECT_EQ(tick_label(2, 1), "2");
  EXPECT_EQ(tick_label(0.4, 0.2), "0.4");
  EXPECT_EQ(tick_label(-1e-17, 1), "0");
}

}  // namespace
}  // namespace gatefield::simulator
