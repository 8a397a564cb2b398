// A board of our own on a pseudo terminal, by its own clock, in the loop of a race in real time. The client needs no
// server; board_flight_test.cpp has one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "client/simulator/simulation.h"
#include "common/config/locate.h"
#include "tests/support/path_follower.h"
#include "tests/support/serial_board.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;
using test::SerialBoard;
using testing::AllOf;
using testing::HasSubstr;

const std::atomic<bool> kGoOn{false};

class BoardInTheLoop : public testing::Test {
 protected:
  BoardInTheLoop() {
    auto loaded = config::load_scenario(config::find_config("scenarios", "circle-0.3m").value());
    EXPECT_TRUE(loaded.ok()) << loaded.error();
    scenario = std::move(loaded).value();
    scenario.vehicle.actuation = config::driven_by(scenario.vehicle, Actuation::Kind::kBodyRates);
    scenario.vehicle.camera.rate_hz = 5.0;                   // nobody looks
    scenario.vehicle.quadrotor.rotor_spin = {-1, -1, 1, 1};  // as the board's mixer has them
    px4.thrust_model_factor = 0.0;                           // outputs of the board are its throttle
    px4.setpoints = SameLink{};
    px4.hil.silence_limit = 1s;  // a busy machine may leave the board's thread waiting
    px4.arm_limit = 40s;
    board_options.loop.failsafe_after = 3s;  // and this one
  }

  Result<Report> race(const ProgressFunction& progress = {}) {
    if (board) px4.hil.address = board->address();
    const scene::World world = config::perturbed_world(scenario.track, scenario.perturbation, scenario.seed);
    test::PathFollower client(world, scenario.vehicle.quadrotor, {.speed_m_s = 1.0});
    Options options;
    options.timing = protocol::Timing::kRealTime;
    options.px4 = px4;
    return fly(scenario, options, &client, kGoOn, progress);
  }

  /// A race in which the board does something else from a second on.
  Report race_with(SerialBoard::Does what) {
    board = std::make_unique<SerialBoard>(board_options);
    auto report = race([&, told = false](const Progress& progress) mutable {
      if (progress.race_time_s > 1.0 && !std::exchange(told, true)) board->from_now_on(what);
    });
    EXPECT_TRUE(report.ok()) << report.error();
    return report ? *report : Report{};
  }
  /// In a second without motors it would have fallen onto the floor.
  bool flew(const Report& report) const {
    return report.race_time_s > 1.0 &&
           std::abs(report.samples.back().state.p_WB.z() - scenario.track.start_p_WB.z()) < 0.5;
  }

  config::Scenario scenario;
  Px4Options px4;
  SerialBoard::Options board_options;
  std::unique_ptr<SerialBoard> board;
};

TEST_F(BoardInTheLoop, ArmsFliesAndIsToldWhenItsCableIsPulled) {
  const Report report = race_with(SerialBoard::Does::kComeOff);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, AllOf(HasSubstr("lost the flight controller after 0 of 12 gates"),
                                     HasSubstr(board->address() + " broke"), HasSubstr("look at cable and power")));
  EXPECT_TRUE(flew(report)) << "it was flown by the board's motors until then";
  EXPECT_THAT(report.firmware, HasSubstr("PX4, system 1, component 1, on serial:/dev/pts/"));
  EXPECT_GT(board->samples(), 100u);
  EXPECT_EQ(board->truths(), 0u) << "a board would fly by it";
}

TEST_F(BoardInTheLoop, OneThatHangsEndsTheRaceInTime) {
  const Report report = race_with(SerialBoard::Does::kHang);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("sent no motor outputs for 1.0 s; it hangs, lost power, or starts again"));
}

TEST_F(BoardInTheLoop, ANoisyLineIsFlownOn) {
  board_options.noise = test::line_noise(1e-3, 7);  // a message of motors in ten is spoiled
  const Report report = race_with(SerialBoard::Does::kDisarm);
  EXPECT_EQ(report.outcome, Outcome::kFlightControllerLost) << report.sentence;
  EXPECT_THAT(report.sentence, HasSubstr("it disarmed in mid-race")) << "what the test did, and nothing else";
  EXPECT_TRUE(flew(report));
}

TEST_F(BoardInTheLoop, AMixerOfAnotherVehicleIsToldBeforeItFlies) {
  scenario.vehicle.quadrotor.rotor_spin = {1, 1, -1, -1};
  board = std::make_unique<SerialBoard>(board_options);
  const auto report = race();
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error(), HasSubstr("asked for a turn about +z (yaw), its motors push another way"));
}

TEST_F(BoardInTheLoop, OneThatIsNotInHilModeIsRefused) {
  board_options.hil = false;
  board = std::make_unique<SerialBoard>(board_options);
  const auto report = race();
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.failure().field, "SYS_HITL");
  EXPECT_FALSE(board->armed());
}

TEST_F(BoardInTheLoop, AnotherBaudRateIsRefused) {
  board_options.noise = [](std::vector<std::uint8_t>* bytes) {
    for (auto& byte : *bytes) byte = static_cast<std::uint8_t>(byte * 37 + 11);
  };
  px4.hil.connect_timeout = 1s;
  board = std::make_unique<SerialBoard>(board_options);
  const auto report = race();
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.failure().code, ErrorCode::kNoAnswer);
  EXPECT_THAT(report.error(), HasSubstr("check the baud rate"));
}

TEST_F(BoardInTheLoop, NoSuchDeviceIsRefused) {
  px4.hil.address = "serial:/dev/no-such-board:921600";
  const auto report = race();
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.failure().code, ErrorCode::kUnreadable);
  EXPECT_EQ(report.failure().field, "device");
  EXPECT_THAT(report.error(), HasSubstr("plug the board in"));
}

TEST_F(BoardInTheLoop, WhatMakesNoSenseIsRefused) {
  px4.hil.address = "serial:/dev/ttyACM0:921600";
  EXPECT_TRUE(validate(px4).ok());
  Px4Options wrong = px4;
  wrong.pace = 0.5;
  EXPECT_EQ(validate(wrong).failure().field, "pace");
  wrong = px4;
  wrong.setpoints = wrong.hil.address;
  EXPECT_EQ(validate(wrong).failure().field, "setpoints");
  wrong = px4;
  wrong.hil.sample_rate_hz = 1000;
  EXPECT_THAT(validate(wrong).error(), AllOf(HasSubstr("sample_rate_hz"), HasSubstr("beside setpoints")));
  wrong.hil.sample_rate_hz = 900;
  wrong.setpoints = px4::BusOptions();
  EXPECT_TRUE(validate(wrong).ok()) << "setpoints on the bus leave room";
}

}  // namespace
}  // namespace gatefield::simulator
