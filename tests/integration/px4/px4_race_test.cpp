#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "client/simulator/simulation.h"
#include "common/config/locate.h"
#include "tests/integration/px4/real_px4.h"
#include "tests/support/path_follower.h"
#include "tests/support/px4_board.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;
using test::Px4Board;
using testing::HasSubstr;

const std::atomic<bool> kGoOn{false};
const Px4Options kUsual;

/// A lap of four displaced gates, by collective thrust and body rates.
config::Scenario circle() {
  auto loaded = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value());
  EXPECT_TRUE(loaded.ok()) << loaded.error();
  config::Scenario scenario = std::move(loaded).value();
  scenario.track.course.laps = 1;
  scenario.vehicle.actuation = config::driven_by(scenario.vehicle, Actuation::Kind::kBodyRates);
  scenario.vehicle.camera.rate_hz = 5.0;  // nobody looks
  return scenario;
}

Result<Report> race(const config::Scenario& scenario, const Px4Options& px4, const ProgressFunction& progress = {}) {
  const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
  test::PathFollower client(world, scenario.vehicle.quadrotor, {.speed_m_s = 3.0});
  Options options;
  options.px4 = px4;
  return fly(scenario, options, &client, kGoOn, progress);
}

class Px4BoardInTheLoop : public testing::Test {
 protected:
  void SetUp() override {
    const std::uint16_t simulator = test::free_port("tcp-listen"), bridge = test::free_port("udp-listen");
    px4.hil.address = "tcp-listen:127.0.0.1:" + std::to_string(simulator);
    px4.setpoints = "udp-listen:127.0.0.1:" + std::to_string(bridge);
    px4.thrust_model_factor = 0.0;  // outputs of the board are its throttle
    px4.pace = 4.0;
    px4.arm_limit = 20s;
    scenario.vehicle.quadrotor.rotor_spin = {-1, -1, 1, 1};  // as the board's mixer has them
    board = std::make_unique<Px4Board>(simulator, bridge);
  }
  /// A race in which the board does something else from 0.2 s on.
  Report race_with(Px4Board::Does what) {
    auto report = race(scenario, px4, [&](const Progress& progress) {
      if (progress.race_time_s > 0.2) board->from_now_on(what);
    });
    EXPECT_TRUE(report.ok()) << report.error();
    return report ? *report : Report{};
  }

  config::Scenario scenario = circle();
  Px4Options px4;
  std::unique_ptr<Px4Board> board;
};

TEST_F(Px4BoardInTheLoop, ArmsFliesALapAndIsStopped) {
  const auto report = race(scenario, px4);
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->outcome, Outcome::kFinished) << summarize(*report);
  EXPECT_EQ(report->passes.size(), 4u);
  EXPECT_THAT(summarize(*report), HasSubstr("Firmware      PX4, system 1"));
  EXPECT_FALSE(board->armed());
}

TEST_F(Px4BoardInTheLoop, OneThatHangsEndsTheRaceWithItsOwnOutcome) {
  const Report report = race_with(Px4Board::Does::kHang);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("lost the flight controller after 0 of 4 gates"));
  EXPECT_THAT(report.sentence, HasSubstr("sent no motor outputs for 1.0 s; it hangs"));
}

TEST_F(Px4BoardInTheLoop, OneThatDiesEndsTheRaceWithItsOwnOutcome) {
  const Report report = race_with(Px4Board::Does::kDie);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr(px4.hil.address)) << "the link that broke is named";
}

TEST_F(Px4BoardInTheLoop, OneThatDisarmsEndsTheRace) {
  const Report report = race_with(Px4Board::Does::kDisarm);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("it disarmed in mid-race"));
}

TEST_F(Px4BoardInTheLoop, OneThatLeavesOurSetpointsEndsTheRace) {
  const Report report = race_with(Px4Board::Does::kLeaveMode);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("it left our setpoints in mid-race"));
}

TEST_F(Px4BoardInTheLoop, OneThatDoesNotArmIsToldWithItsReason) {
  board->refuse_to_arm();
  px4.arm_limit = 6s;
  const auto report = race(scenario, px4);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.failure().code, ErrorCode::kNotAnswering);
  EXPECT_THAT(report.error(), HasSubstr("it did not arm and hover within 6 s"));
  EXPECT_FALSE(board->armed());
}

TEST_F(Px4BoardInTheLoop, AMixerOfAnotherVehicleIsToldBeforeItFlies) {
  scenario.vehicle.quadrotor.rotor_spin = {1, 1, -1, -1};
  const auto report = race(scenario, px4);
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error(), HasSubstr("asked for a turn about +z (yaw), its motors push another way"));
  EXPECT_FALSE(board->armed());
}

TEST(Px4InTheLoop, NobodyThatConnectsIsTold) {
  Px4Options px4;
  px4.hil.address = "tcp-listen:127.0.0.1:0";
  px4.hil.connect_timeout = 200ms;
  const auto report = race(circle(), px4);
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.failure().code, ErrorCode::kNoAnswer);
  EXPECT_THAT(report.error(), HasSubstr("no firmware connected to tcp-listen:127.0.0.1:0"));
}

TEST(Px4InTheLoop, WhatMakesNoSenseIsRefused) {
  const auto refused = [](const config::Scenario& scenario, const Px4Options& px4) {
    return race(scenario, px4).failure().field;
  };
  Px4Options px4;
  px4.pace = 0.0;
  EXPECT_EQ(refused(circle(), px4), "pace");
  px4 = kUsual;
  px4.thrust_model_factor = 1.1;
  EXPECT_EQ(refused(circle(), px4), "thrust_model_factor");
  px4 = kUsual;
  px4.arm_limit = 0s;
  EXPECT_EQ(refused(circle(), px4), "arm_limit");
  px4 = kUsual;
  px4.setpoints = SameLink{};
  EXPECT_EQ(refused(circle(), px4), "setpoints");
  px4 = kUsual;
  px4.setpoints = "smoke:signals";
  EXPECT_EQ(refused(circle(), px4), "setpoints.kind");
  config::Scenario scenario = circle();
  scenario.vehicle.actuation.kind = Actuation::Kind::kRotorThrusts;
  EXPECT_EQ(refused(scenario, kUsual), "actuation");
  scenario = circle();
  for (auto& arm : scenario.vehicle.quadrotor.rotor_position_B_m)
    arm = PlainVector2(Eigen::Rotation2Dd(0.785).toRotationMatrix() * arm);
  EXPECT_EQ(refused(scenario, kUsual), "quadrotor.rotor");
}

TEST(Px4InTheLoop, IsFlownInLockstepAndByNobodyElse) {
  Options options;
  options.px4.emplace();
  options.timing = protocol::Timing::kRealTime;
  EXPECT_EQ(validate(options).failure().field, "timing");
  options.firmware.emplace();
  EXPECT_EQ(validate(options).failure().field, "px4");
}

class RealPx4InTheLoop : public testing::Test {
 protected:
  void SetUp() override {
    if (test::RealPx4::program().empty())
      GTEST_SKIP() << "left out: GATEFIELD_PX4_SITL names no program (bin/px4 of a PX4 built for the target SITL)";
    px4.setpoints = "udp-listen:127.0.0.1:14540";
    firmware = std::make_unique<test::RealPx4>(folder, test::px4_settings(scenario.vehicle.quadrotor));
  }
  void TearDown() override {
    firmware.reset();
    std::filesystem::remove_all(folder);
  }

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("gatefield-px4-" + std::to_string(getpid()));
  config::Scenario scenario = circle();
  Px4Options px4;
  std::unique_ptr<test::RealPx4> firmware;
};

TEST_F(RealPx4InTheLoop, FliesALap) {
  const auto report = race(scenario, px4);
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->outcome, Outcome::kFinished) << summarize(*report);
}

TEST_F(RealPx4InTheLoop, KilledInMidRaceItEndsTheRaceWithItsOwnOutcome) {
  const auto report = race(scenario, px4, [&](const Progress& progress) {
    if (progress.race_time_s > 0.2) firmware->kill();
  });
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->outcome, Outcome::kFlightControllerLost) << report->sentence;
}

}  // namespace
}  // namespace gatefield::simulator
