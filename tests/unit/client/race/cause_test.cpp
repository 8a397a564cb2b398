#include "client/race/cause.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/simulator/simulation.h"
#include "common/config/locate.h"
#include "common/config/scenario.h"

namespace gatefield::race {
namespace {

using simulator::Outcome;

/// A flight of one second that ends at gate 1 (of 0 to 3), and what its planner believed.
class Causes : public testing::Test {
 protected:
  Causes() {
    const auto scenario = config::load_scenario(config::find_config("scenarios", "circle").value()).value();
    gates_ = config::gates_by_waypoint(config::nominal_world(scenario.track), scenario.track.course);
    report_.outcome = Outcome::kTouchedGate;
    report_.culprit = 1;
    report_.race_time_s = 1.0;
    report_.samples.resize(1);
    report_.samples[0].expected_waypoint = 1;
    for (int i = 0; i < 50; ++i) {
      trace::Step step;
      step.stamp = simulator::kLockstepEpoch + std::chrono::milliseconds(20 * i);
      step.waypoint = 1;
      step.seen = true;
      step.center_W = gates_[1].X_WG.translation();
      step.axis_W = gates_[1].X_WG.linear().col(0);
      trace_.push_back(step);
    }
  }
  Diagnosis diagnosis() const { return diagnose(report_, trace_, gates_); }

  std::vector<scene::Gate> gates_;
  simulator::Report report_;
  std::vector<trace::Step> trace_;
};

TEST_F(Causes, AKnownGateThatIsHitIsControls) {
  const Diagnosis found = diagnosis();
  EXPECT_EQ(found.cause, Cause::kControl);
  EXPECT_EQ(found.waypoint, 1);
  EXPECT_NEAR(found.center_error_m, 0.0, 1e-9);
  EXPECT_NEAR(found.seen_before_s, 1.0, 1e-6);
  report_.outcome = Outcome::kMissedGate;
  EXPECT_EQ(diagnosis().cause, Cause::kControl);
}

TEST_F(Causes, AGateBelievedElsewhereIsPerceptions) {
  for (auto& step : trace_) step.center_W.x() += 0.4;
  EXPECT_EQ(diagnosis().cause, Cause::kPerceptionWrong);
  EXPECT_NEAR(diagnosis().center_error_m, 0.4, 1e-9);
}

TEST_F(Causes, ABeliefIsJudgedWhereTheStateEstimateHasTheGate) {
  report_.samples[0].t_s = 1.0;
  report_.samples[0].X_EW.translation() = Eigen::Vector3d(0.5, 0, 0);
  EXPECT_EQ(diagnosis().cause, Cause::kPerceptionWrong);
  EXPECT_NEAR(diagnosis().center_error_m, 0.5, 1e-9);
  for (auto& step : trace_) step.center_W.x() += 0.5;
  EXPECT_EQ(diagnosis().cause, Cause::kControl);
  EXPECT_NEAR(diagnosis().center_error_m, 0.0, 1e-9);
}

TEST_F(Causes, OnlyTheLastMomentsAreJudged) {
  for (int i = 0; i < 15; ++i) trace_[static_cast<std::size_t>(i)].center_W.x() += 2.0;
  EXPECT_EQ(diagnosis().cause, Cause::kControl);
}

TEST_F(Causes, AGateBelievedTurnedIsPerceptionsFromEitherSide) {
  for (auto& step : trace_)
    step.axis_W = Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ()) * gates_[1].X_WG.linear().col(0);
  EXPECT_EQ(diagnosis().cause, Cause::kPerceptionWrong);
  EXPECT_NEAR(diagnosis().axis_error_rad, M_PI - 2.5, 1e-9);
}

TEST_F(Causes, HeadingForAnotherGateIsPerceptions) {
  for (std::size_t i = 40; i < trace_.size(); ++i) trace_[i].waypoint = 2;
  EXPECT_EQ(diagnosis().cause, Cause::kPerceptionWrong);
}

TEST_F(Causes, AGateFirstSeenShortlyBeforeIsSeenTooLate) {
  for (std::size_t i = 0; i < 30; ++i) trace_[i].seen = false;
  EXPECT_EQ(diagnosis().cause, Cause::kSeenTooLate);
  for (auto& step : trace_) step.seen = false;
  EXPECT_EQ(diagnosis().cause, Cause::kSeenTooLate);
  EXPECT_TRUE(std::isnan(diagnosis().seen_before_s));
}

TEST_F(Causes, TimeAndVolumeAreTheReferees) {
  for (const Outcome outcome : {Outcome::kTimeLimit, Outcome::kStalled, Outcome::kOutOfBounds}) {
    report_.outcome = outcome;
    EXPECT_EQ(diagnosis().cause, Cause::kReferee);
  }
}

TEST_F(Causes, AFrameTouchedOnTheWayOutIsJudgedByTheBeliefBeforeThePass) {
  report_.samples[0].expected_waypoint = 2;
  report_.passes.push_back({std::chrono::milliseconds(900), 0, 1, 0.3, 8.0});
  for (std::size_t i = 46; i < trace_.size(); ++i) trace_[i].waypoint = 2;
  EXPECT_EQ(diagnosis().cause, Cause::kControl);
  EXPECT_EQ(diagnosis().waypoint, 1);
}

TEST_F(Causes, WonRacesHaveNoneAndUnrecordedOnesSaySo) {
  trace_.clear();
  EXPECT_EQ(diagnosis().cause, Cause::kNotRecorded);
  report_.outcome = Outcome::kFinished;
  EXPECT_EQ(diagnosis().cause, Cause::kNone);
}

}  // namespace
}  // namespace gatefield::race
