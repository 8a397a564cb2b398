#include "client/bridge/mavlink/vehicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench.h"
#include "client/firmware/mavlink/constants.h"
#include "common/base/random.h"
#include "tests/support/allocation_trap.h"
#include "tests/support/mavlink_words.h"
#include "tests/support/towards.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;
using mavlink::Command;
using mavlink::CommandResult;
using testing::HasSubstr;

const double kWeight_n = QuadrotorModel{}.mass_kg * kGravity_m_s2;

class EachDialect : public testing::TestWithParam<Dialect> {};
INSTANTIATE_TEST_SUITE_P(MavlinkVehicle, EachDialect,
                         testing::Values(Dialect::kPx4, Dialect::kArduPilot, Dialect::kPlain),
                         [](const auto& dialect) { return std::string(rules(dialect.param).name); });

// ---- finding it ----------------------------------------------------------------------------------------------------

TEST_P(EachDialect, ConnectsAndSaysWhatItFound) {
  Bench bench(bench_config(GetParam()));
  const Status status = bench.vehicle->connect();
  ASSERT_TRUE(status.ok()) << status.error();
  EXPECT_THAT(bench.vehicle->complaints(), testing::IsEmpty());
  EXPECT_THAT(bench.vehicle->description().at(0), HasSubstr("system 1, component 1"));
  EXPECT_THAT(bench.vehicle->description().at(1), HasSubstr("its clock 40.00"));
}

TEST(MavlinkVehicle, NobodyThereIsToldWithWhatToDo) {
  auto config = bench_config(Dialect::kPx4);
  config.connect_timeout = 500ms;
  Bench bench(config);
  bench.controller->silent = true;
  const Status status = bench.vehicle->connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().code, ErrorCode::kNoAnswer);
  EXPECT_THAT(status.error(),
              HasSubstr("no heartbeat of an autopilot on tcp:127.0.0.1:5760; check address, baud rate"));
}

TEST(MavlinkVehicle, BytesWithoutFramesAreToldAsAWrongBaudRate) {
  auto config = bench_config(Dialect::kPx4);
  config.connect_timeout = 500ms;
  Bench bench(config);
  bench.cable->noise = [](std::deque<std::uint8_t>* bytes) { std::ranges::fill(*bytes, 0x55); };
  ASSERT_FALSE(bench.vehicle->connect().ok());
  EXPECT_TRUE(bench.complains_of("check the baud rate"));
}

TEST(MavlinkVehicle, AnotherFirmwareIsRefused) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->bends = [](mavlink::Message* message) {
    if (auto* heartbeat = std::get_if<mavlink::Heartbeat>(message)) heartbeat->autopilot = 3;
  };
  const Status status = bench.vehicle->connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().field, "dialect");
  EXPECT_EQ(status.error(), "the autopilot is ArduPilot, expected PX4; set the dialect");
  bench.fly(5s, 0, {0, 0, 0});
  EXPECT_EQ(bench.commands(Command::kDoSetMode) + bench.commands(Command::kArmDisarm), 0);
}

TEST(MavlinkVehicle, ThrustThatDoesNotMeanThrustIsRefused) {
  Bench bench(bench_config(Dialect::kArduPilot));
  bench.controller->parameters["GUID_OPTIONS"].param_value = 4;
  const Status status = bench.vehicle->connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().field, "GUID_OPTIONS");
  EXPECT_THAT(status.error(), HasSubstr("GUID_OPTIONS is 4, expected bit 3 (8) in it"));
  bench.fly(5s, 0, {0, 0, 0});
  EXPECT_FALSE(bench.controller->armed());
  EXPECT_FALSE(bench.controller->follows());
}

TEST(MavlinkVehicle, ThrustBitIsSetWhereAllowed) {
  auto config = bench_config(Dialect::kArduPilot);
  config.may_set_parameters = true;
  Bench bench(config);
  bench.controller->parameters["GUID_OPTIONS"].param_value = 4;
  EXPECT_TRUE(bench.vehicle->connect().ok());
  EXPECT_EQ(bench.controller->parameters["GUID_OPTIONS"].param_value, 12.0F);
}

TEST(MavlinkVehicle, OnlyTheFirstAutopilotIsHeard) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  mavlink::Heartbeat other;
  other.autopilot = static_cast<std::uint8_t>(mavlink::AutopilotKind::kPx4);
  other.base_mode = mavlink::kModeArmed;
  bench.controller->send(other, {2, 1});
  bench.controller->send(other, {1, 100});  // a camera of the same system
  bench.run(10ms);
  EXPECT_FALSE(bench.status().armed);
}

TEST(MavlinkVehicle, TheConfiguredSystemIsWaitedFor) {
  auto config = bench_config(Dialect::kPx4);
  config.vehicle_system = 9;
  config.connect_timeout = 1s;
  Bench bench(config);
  EXPECT_FALSE(bench.vehicle->connect().ok());
  bench.controller->address = {9, 1};
  EXPECT_TRUE(bench.vehicle->connect().ok());
}

TEST(MavlinkVehicle, GroundStationsAreNoAutopilots) {
  auto config = bench_config(Dialect::kPlain);
  config.connect_timeout = 1s;
  Bench bench(config);
  bench.controller->bends = [](mavlink::Message* message) {
    if (auto* heartbeat = std::get_if<mavlink::Heartbeat>(message)) heartbeat->type = 6;
  };
  EXPECT_FALSE(bench.vehicle->connect().ok());
}

// ---- states --------------------------------------------------------------------------------------------------------

TEST_P(EachDialect, GivesStatesOfOurClockAndAxes) {
  Bench bench(bench_config(GetParam()));
  bench.controller->state.p_WB = {1, 2, 3};
  bench.controller->state.v_WB = {4, 5, 6};
  bench.controller->state.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()));
  bench.controller->state.w_WB_B = {0.1, 0.2, 0.3};
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(2s);
  const auto state = bench.vehicle->states()->newest(bench.now());
  ASSERT_TRUE(state);
  EXPECT_LE(bench.now() - state->stamp, 12ms);
  EXPECT_GE(bench.now() - state->stamp, -1ms);
  EXPECT_FALSE(state->thrust_known);
  EXPECT_LE((state->state.p_WB - bench.controller->state.p_WB).norm(), 1e-5);
  EXPECT_LE((state->state.v_WB - bench.controller->state.v_WB).norm(), 1e-5);
  EXPECT_LE((state->state.w_WB_B - bench.controller->state.w_WB_B).norm(), 1e-6);
  EXPECT_LE(Eigen::Quaterniond(state->state.q_WB).angularDistance(Eigen::Quaterniond(bench.controller->state.q_WB)),
            1e-3);
}

TEST(MavlinkVehicle, FallsBackToPositionAndAttitude) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->sends_odometry = false;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(3s);
  const auto state = bench.vehicle->states()->newest(bench.now());
  ASSERT_TRUE(state);
  EXPECT_LE(bench.now() - state->stamp, 13ms);
  EXPECT_EQ(bench.controller->heard[mavlink::Odometry::kId], 0);
}

TEST(MavlinkVehicle, ReadsStampsThatCountFrom1970) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->unix_stamps = true;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(3s);
  const auto state = bench.vehicle->states()->newest(bench.now());
  ASSERT_TRUE(state);
  EXPECT_LE(std::chrono::abs(bench.now() - state->stamp - 5ms), 8ms);
}

TEST(MavlinkVehicle, WithoutTimeSyncThereIsNoState) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->answers_time = false;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  EXPECT_FALSE(bench.vehicle->states()->newest(bench.now()));
  EXPECT_TRUE(bench.complains_of("answers no TIMESYNC"));
}

TEST(MavlinkVehicle, AnswersOfTimeAreKnownByTheirQuestions) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->bends = [](mavlink::Message* message) {  // as PX4 1.16, which leaves there what was there
    if (auto* answer = std::get_if<mavlink::Timesync>(message)) answer->target_system = 173;
  };
  ASSERT_TRUE(bench.vehicle->connect().ok());
  EXPECT_THAT(bench.vehicle->complaints(), testing::IsEmpty());
  EXPECT_TRUE(bench.vehicle->states()->newest(bench.now()));
}

TEST(MavlinkVehicle, StampsOfArrivalNeedNoTimeSync) {
  auto config = bench_config(Dialect::kPlain);
  config.stamps = Stamps::kArrival;
  config.link_delay = 4ms;
  Bench bench(config);
  bench.controller->answers_time = false;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(2s);
  const auto state = bench.vehicle->states()->newest(bench.now());
  ASSERT_TRUE(state);
  EXPECT_LE(bench.now() - state->stamp, 15ms);
  EXPECT_GE(bench.now() - state->stamp, 4ms);
  EXPECT_THAT(bench.vehicle->complaints(), testing::IsEmpty());
}

TEST(MavlinkVehicle, StampsThatContradictTheClockAreRefusedAndTold) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->stamps_off = 40ms;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(2s);
  EXPECT_FALSE(bench.vehicle->states()->newest(bench.now()));
  EXPECT_TRUE(bench.complains_of("state.age is -39"));
}

TEST(MavlinkVehicle, ARestartOfTheAutopilotIsSeenThrough) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(2s);
  const auto before = bench.controller->heard[mavlink::ParamRequestRead::kId];
  bench.controller->boot = -bench.now();  // it has just booted
  bench.run(4s);
  EXPECT_EQ(bench.vehicle->report().clock_restarts, 1U);
  EXPECT_GT(bench.controller->heard[mavlink::ParamRequestRead::kId], before) << "everything is asked for again";
  EXPECT_LE(bench.now() - bench.vehicle->states()->newest(bench.now())->stamp, 12ms);
}

TEST(MavlinkVehicle, SilenceIsTold) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.controller->silent = true;
  const Stamp heard = bench.status().stamp;
  bench.run(4s);
  EXPECT_EQ(bench.status().stamp, heard);
  EXPECT_TRUE(bench.complains_of("silent for 4"));
}

TEST(MavlinkVehicle, BrokenMessagesCostThemselvesAndAreTold) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(1s);
  const auto states = bench.vehicle->report().states;
  int count = 0;
  bench.controller->bends = [&](mavlink::Message* message) {
    if (auto* odometry = std::get_if<mavlink::Odometry>(message); odometry != nullptr && ++count % 2 == 0)
      odometry->vx = std::nanf("");
  };
  bench.run(1s);
  EXPECT_NEAR(static_cast<double>(bench.vehicle->report().states - states), 50.0, 3.0);
  EXPECT_TRUE(bench.complains_of("ODOMETRY.vx is nan, expected -1000 to 1000 m/s"));
}

TEST(MavlinkVehicle, AFieldOutOfRangeCostsItsMessageAndNothingElse) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->state.p_WB = {1, 2, 3};
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(1s, Wanted::kDisarmed);
  test::for_each_faulty_message([&](const std::string& name, const mavlink::Message& message) {
    const auto before = bench.vehicle->report().faults;
    bench.controller->send(message);
    bench.hold(2ms, Wanted::kDisarmed);
    ASSERT_EQ(bench.vehicle->report().faults, before + 1) << name;
    const auto& fault = bench.vehicle->report().fault;
    EXPECT_EQ(name.rfind(std::string(fault->message) + ".", 0), 0U) << name;
    const auto state = bench.vehicle->states()->newest(bench.now());
    ASSERT_TRUE(state) << name;
    EXPECT_LE((state->state.p_WB - bench.controller->state.p_WB).norm(), 1e-5) << name;
    const auto status = bench.status();
    EXPECT_FALSE(status.armed || status.follows_us || status.own_failsafe) << name;
    EXPECT_NEAR(status.battery_v.value(), 15.5, 1e-3) << name;
    EXPECT_EQ(status.on_ground, true) << name;
    EXPECT_FALSE(status.pilot->arm || status.pilot->take_over || status.pilot->kill) << name;
  });
}

TEST(MavlinkVehicle, NoNumberThatAnAutopilotCanSayArmsIt) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(1s, Wanted::kDisarmed);
  int sent = 0;
  test::for_each_extreme_message([&](const std::string& name, const mavlink::Message& message) {
    bench.controller->send(message);
    if (++sent % 16 != 0) return;
    bench.hold(2ms, Wanted::kDisarmed);
    const auto state = bench.vehicle->states()->newest(bench.now());
    ASSERT_TRUE(!state || (state->state.p_WB.allFinite() && state->state.v_WB.allFinite() &&
                           state->state.w_WB_B.allFinite() && state->state.q_WB.coeffs().allFinite()))
        << name;
  });
  EXPECT_GT(sent, 10000);
  EXPECT_EQ(bench.commands(Command::kDoSetMode), 0);
  for (const mavlink::CommandLong& command : bench.controller->commands)
    EXPECT_FALSE(command.command == static_cast<std::uint16_t>(Command::kArmDisarm) && command.param1 != 0.0F);
  EXPECT_FALSE(bench.controller->armed());
  bench.controller->target.reset();
  bench.hold(1s, Wanted::kDisarmed);
  EXPECT_TRUE(bench.controller->target) << "it goes on";
}

TEST(MavlinkVehicle, ANoisyLineCostsWhatItBreaks) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(1s);
  Random random(5, Stream("test.mavlink.noisy_line"));
  bench.cable->noise = [&](std::deque<std::uint8_t>* bytes) {
    for (auto& byte : *bytes)
      if (random.uniform() < 1e-3) byte = static_cast<std::uint8_t>(random.bits());
    if (random.uniform() < 0.02) bytes->resize(bytes->size() / 2);
  };
  Stamp oldest{0};
  for (int i = 0; i < 1000; ++i) {
    bench.run(5ms);
    oldest = std::max(oldest, bench.now() - bench.vehicle->states()->newest(bench.now())->stamp);
  }
  EXPECT_LE(oldest, 100ms);
  EXPECT_EQ(bench.vehicle->report().faults, 0U) << "what has a right checksum was sent so";
}

// ---- arming and following ------------------------------------------------------------------------------------------

TEST_P(EachDialect, ArmsAndFollowsWhenThatIsWanted) {
  Bench bench(bench_config(GetParam()));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(2s, Wanted::kDisarmed);
  EXPECT_FALSE(bench.controller->armed());
  EXPECT_EQ(bench.commands(Command::kDoSetMode) + bench.commands(Command::kArmDisarm), 0);
  bench.hold(2s, Wanted::kArmed);
  EXPECT_TRUE(bench.controller->armed());
  EXPECT_EQ(bench.controller->follows(), GetParam() != Dialect::kPlain);
  EXPECT_TRUE(bench.status().armed);
  EXPECT_TRUE(bench.status().follows_us);
  bench.hold(2s, Wanted::kDisarmed);
  EXPECT_FALSE(bench.controller->armed());
}

TEST(MavlinkVehicle, AsksForNothingBeforeSetpointsHaveBeenSentForAWhile) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.vehicle->flight_controller().want(bench.now(), Wanted::kArmed);
  bench.run(5s);
  EXPECT_EQ(bench.commands(Command::kDoSetMode), 0);
  bench.hold(900ms, Wanted::kArmed);
  EXPECT_EQ(bench.commands(Command::kDoSetMode), 0);
  bench.hold(200ms, Wanted::kArmed);
  EXPECT_EQ(bench.commands(Command::kDoSetMode), 1);
}

TEST(MavlinkVehicle, ArmingIsThePersonsUnlessToldOtherwise) {
  auto config = bench_config(Dialect::kPx4);
  config.arm_by_command = false;
  Bench bench(config);
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(5s, Wanted::kArmed);
  EXPECT_TRUE(bench.controller->follows());
  EXPECT_FALSE(bench.controller->armed());
  EXPECT_EQ(bench.commands(Command::kArmDisarm), 0);
  bench.controller->loop().arm_switch(bench.now(), true);
  bench.hold(1s, Wanted::kArmed);
  EXPECT_TRUE(bench.status().armed);
}

TEST(MavlinkVehicle, TriesAgainWhatIsNotAnsweredOrRefused) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.controller->overhears[static_cast<std::uint16_t>(Command::kDoSetMode)] = 3;
  bench.controller->refuses[static_cast<std::uint16_t>(Command::kArmDisarm)] = CommandResult::kTemporarilyRejected;
  bench.hold(5s, Wanted::kArmed);
  EXPECT_TRUE(bench.controller->follows());
  EXPECT_EQ(bench.commands(Command::kDoSetMode), 4);
  EXPECT_FALSE(bench.controller->armed());
  EXPECT_TRUE(bench.complains_of("arming was refused: not now"));
  bench.controller->refuses.clear();
  bench.hold(2s, Wanted::kArmed);
  EXPECT_TRUE(bench.controller->armed());
}

TEST(MavlinkVehicle, RefusalsComeWithTheAutopilotsOwnWords) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.controller->refuses[static_cast<std::uint16_t>(Command::kDoSetMode)] = CommandResult::kDenied;
  mavlink::StatusText words;
  words.severity = 4;
  std::ranges::copy(std::string_view("Offboard: no position"), words.text.begin());
  bench.controller->send(words);
  bench.hold(3s, Wanted::kArmed);
  EXPECT_TRUE(bench.complains_of("mode OFFBOARD was refused: denied; it says: \"Offboard: no position\""));
}

TEST(MavlinkVehicle, WhatSomebodyTookIsNotTakenBack) {
  for (const bool mode : {true, false}) {
    Bench bench(bench_config(Dialect::kPx4));
    ASSERT_TRUE(bench.vehicle->connect().ok());
    bench.hold(3s, Wanted::kArmed);
    ASSERT_TRUE(bench.status().armed && bench.status().follows_us);
    const int commands = bench.commands(Command::kDoSetMode) + bench.commands(Command::kArmDisarm);
    if (mode)
      bench.controller->leave_mode();
    else
      bench.controller->loop().arm_switch(bench.now(), false);
    bench.hold(5s, Wanted::kArmed);
    EXPECT_EQ(bench.commands(Command::kDoSetMode) + bench.commands(Command::kArmDisarm), commands);
    EXPECT_TRUE(bench.complains_of("left our setpoints"));
    bench.hold(1s, Wanted::kReleased);
    bench.hold(3s, Wanted::kArmed);
    EXPECT_TRUE(bench.status().armed && bench.status().follows_us) << "asked for again after another wish";
  }
}

TEST(MavlinkVehicle, KillsInTheAirAndDisarmsOnTheGroundOnly) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  bench.controller->on_ground = false;
  bench.hold(2s, Wanted::kDisarmed);
  EXPECT_TRUE(bench.controller->armed());
  EXPECT_TRUE(bench.complains_of("arming was refused: denied"));
  bench.hold(100ms, Wanted::kKilled);
  EXPECT_FALSE(bench.controller->armed());
}

TEST(MavlinkVehicle, ReleasedAsksForNothing) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  const auto commands = bench.controller->commands.size();
  bench.hold(3s, Wanted::kReleased);
  EXPECT_EQ(bench.controller->commands.size(), commands);
  EXPECT_TRUE(bench.controller->armed());
}

// ---- status --------------------------------------------------------------------------------------------------------

TEST(MavlinkVehicle, TellsRadioBatteryGroundAndForce) {
  auto config = bench_config(Dialect::kPx4);
  config.arm_by_command = false;
  config.radio = {5, 6, 7, 1600};
  Bench bench(config);
  bench.controller->specific_force_z = 12.5;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(3s);
  auto status = bench.status();
  ASSERT_TRUE(status.pilot);
  EXPECT_FALSE(status.pilot->arm || status.pilot->take_over || status.pilot->kill);
  EXPECT_NEAR(status.battery_v.value(), 15.5, 1e-9);
  EXPECT_TRUE(status.on_ground.value());
  EXPECT_NEAR(status.specific_force_z_m_s2.value(), 12.5, 1e-5);
  EXPECT_TRUE(status.q_WB);
  EXPECT_FALSE(status.own_failsafe);
  EXPECT_EQ(status.failsafe, flight::FirmwareFailsafe::kGood);

  bench.controller->radio_us[4] = 1900;
  bench.controller->radio_us[6] = 1600;
  bench.controller->on_ground = false;
  bench.controller->system_status = 5;
  bench.run(1s);
  status = bench.status();
  EXPECT_TRUE(status.pilot->arm);
  EXPECT_FALSE(status.pilot->take_over);
  EXPECT_TRUE(status.pilot->kill);
  EXPECT_FALSE(status.on_ground.value());
  EXPECT_TRUE(status.own_failsafe);

  bench.controller->radio_channels = 0;
  bench.run(1s);
  EXPECT_FALSE(bench.status().pilot) << "the radio is gone";
  bench.controller->silent = true;
  bench.run(2s);
  EXPECT_FALSE(bench.status().specific_force_z_m_s2) << "what is old is not told";
}

TEST(MavlinkVehicle, PressureInPascalCostsNoForce) {
  Bench bench(bench_config(Dialect::kPx4));
  bench.controller->specific_force_z = 12.5;
  bench.controller->bends = [](mavlink::Message* message) {
    if (auto* imu = std::get_if<mavlink::HighresImu>(message)) imu->abs_pressure = 95580.625F;  // as PX4 1.16 has it
  };
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.run(3s);
  EXPECT_NEAR(bench.status().specific_force_z_m_s2.value_or(0.0), 12.5, 1e-5);
  EXPECT_THAT(bench.vehicle->complaints(), testing::IsEmpty());
}

TEST(MavlinkVehicle, ABadFailsafeIsTold) {
  Bench bench(bench_config(Dialect::kArduPilot));
  bench.controller->parameters["FS_GCS_ENABLE"].param_value = 0;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  EXPECT_EQ(bench.status().failsafe, flight::FirmwareFailsafe::kBad);
}

// ---- setpoints -----------------------------------------------------------------------------------------------------

TEST(MavlinkVehicle, SendsRatesAndThrustInTheAutopilotsAxes) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.fly(100ms, kWeight_n, {1, 2, 3});
  ASSERT_TRUE(bench.controller->target);
  const auto& target = *bench.controller->target;
  EXPECT_EQ(target.body_roll_rate, 1.0F);
  EXPECT_EQ(target.body_pitch_rate, -2.0F);
  EXPECT_EQ(target.body_yaw_rate, -3.0F);
  EXPECT_NEAR(target.thrust, flight::ThrustOptions{}.hover_throttle, 1e-6);
  EXPECT_EQ(target.type_mask, mavlink::kIgnoreAttitude);
  EXPECT_EQ(target.target_system, 1);
}

TEST(MavlinkVehicle, SendsNothingRatherThanNonsense) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.fly(100ms, kWeight_n, {1, std::nan(""), 3});
  EXPECT_FALSE(bench.controller->target);
  EXPECT_TRUE(bench.complains_of("setpoints were out of range"));
}

TEST(MavlinkVehicle, HoldsWithoutThrustOnTheGroundAndWithItInTheAir) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  EXPECT_EQ(bench.controller->target->thrust, 0.0F);
  bench.controller->on_ground = false;
  bench.hold(1s, Wanted::kArmed);
  EXPECT_NEAR(bench.controller->target->thrust, flight::ThrustOptions{}.hover_throttle, 1e-6);
}

TEST(MavlinkVehicle, HeightTellsTheGroundWhereTheAutopilotDoesNot) {
  Bench bench(bench_config(Dialect::kPlain));
  bench.controller->bends = [](mavlink::Message* message) {
    if (auto* state = std::get_if<mavlink::ExtendedSysState>(message)) state->landed_state = 0;
  };
  bench.controller->state.p_WB.z() = 5.0;  // the ground lies where it was armed
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  ASSERT_TRUE(bench.status().armed);
  EXPECT_FALSE(bench.status().on_ground);
  EXPECT_EQ(bench.controller->target->thrust, 0.0F);
  bench.controller->state.p_WB.z() = 5.5;
  bench.hold(1s, Wanted::kArmed);
  EXPECT_GT(bench.controller->target->thrust, 0.1F);
}

TEST(MavlinkVehicle, FullLinkAndBrokenLinkAreTold) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.cable->full = true;
  bench.fly(100ms, kWeight_n, {0, 0, 0});
  EXPECT_TRUE(bench.complains_of("found no room on cable"));
  bench.cable->full = false;
  bench.cable->broken = firmware::Transfer::kHungUp;
  bench.run(10ms);
  EXPECT_TRUE(bench.complains_of("cable"));
}

TEST(MavlinkVehicle, AllocatesNothingInAStep) {
  Bench bench(bench_config(Dialect::kPx4));
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  bench.cable->cut = true;
  bench.cable->on_wait = nullptr;
  const test::AllocationTrap trap;
  for (int i = 0; i < 100; ++i) {
    (void)bench.vehicle->states()->newest(bench.now());
    (void)bench.vehicle->flight_controller().newest(bench.now());
    bench.vehicle->flight_controller().want(bench.now(), Wanted::kArmed);
    bench.vehicle->actuator().apply(bench.now(), {});
    bench.vehicle->actuator().hold(bench.now());
  }
  EXPECT_EQ(trap.count(), 0U);
}

// ---- all of it -----------------------------------------------------------------------------------------------------

TEST_P(EachDialect, FliesToAPlaceAndLetsItsThrustBeLearned) {
  auto config = bench_config(GetParam());
  config.setpoint_rate_hz = 200;
  config.state_rate_hz = 200;
  config.thrust.hover_throttle = 0.35;  // the motors' square law needs 0.43 with the idle output
  Bench bench(config);
  bench.moves = true;
  ASSERT_TRUE(bench.vehicle->connect().ok());
  bench.hold(3s, Wanted::kArmed);
  ASSERT_TRUE(bench.status().armed);
  const Eigen::Vector3d goal(2, -1, 3);
  for (const Stamp end = bench.now() + 12s; bench.now() < end;
       bench.vehicle->clock()->sleep_until(bench.now() + bench.vehicle->actuator().period())) {
    const auto state = bench.vehicle->states()->newest(bench.now());
    bench.vehicle->flight_controller().want(bench.now(), Wanted::kArmed);
    ASSERT_TRUE(state);
    if (state->state.p_WB.z() > 0.1) bench.vehicle->thrust().begin();
    bench.vehicle->thrust().on_state(state->stamp, state->state, bench.status().specific_force_z_m_s2);
    bench.vehicle->actuator().apply(bench.now(), test::towards(goal, state->state, config.quadrotor));
  }
  EXPECT_LE((bench.controller->state.p_WB - goal).norm(), 0.1) << bench.controller->state.p_WB.transpose();
  EXPECT_LE(bench.controller->state.v_WB.norm(), 0.1);
  EXPECT_NEAR(bench.vehicle->thrust().factor(), 0.67, 0.1);
  EXPECT_TRUE(bench.complains_of("hover")) << "a third less thrust than configured is told";
}

}  // namespace
}  // namespace gatefield::bridge
