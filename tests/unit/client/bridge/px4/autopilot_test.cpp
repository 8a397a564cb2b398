#include "client/bridge/px4/autopilot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "bench.h"
#include "tests/support/allocation_trap.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using flight::Wanted;
using mavlink::Command;
using mavlink::CommandResult;

// ---- states --------------------------------------------------------------------------------------------------------

class EachVelocityFrame : public testing::TestWithParam<px4::VelocityFrame> {};
INSTANTIATE_TEST_SUITE_P(Px4Autopilot, EachVelocityFrame,
                         testing::Values(px4::VelocityFrame::kNed, px4::VelocityFrame::kBodyFrd));

TEST_P(EachVelocityFrame, GivesStatesOfOurClockAndAxes) {
  Bench bench(bench_config());
  bench.controller.velocity_frame = static_cast<std::uint8_t>(GetParam());
  QuadrotorState& truth = bench.controller.state;
  truth.p_WB = {1, 2, 3};
  truth.v_WB = {4, 5, 6};
  truth.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 3).normalized()));
  truth.w_WB_B = {0.1, 0.2, 0.3};
  bench.run(1s);
  const auto& state = bench.autopilot.state();
  ASSERT_TRUE(state);
  EXPECT_LE(bench.now() - state->stamp, 10ms);
  EXPECT_FALSE(state->thrust_known);
  EXPECT_LE((state->state.p_WB - truth.p_WB).norm(), 1e-5);
  EXPECT_LE((state->state.v_WB - truth.v_WB).norm(), 1e-5);
  EXPECT_LE((state->state.w_WB_B - truth.w_WB_B).norm(), 1e-6);
  EXPECT_LE(Eigen::Quaterniond(state->state.q_WB).angularDistance(Eigen::Quaterniond(truth.q_WB)), 1e-3);
}

TEST(Px4Autopilot, StatesAreTurnedIntoTheCoursesFrame) {
  auto config = bench_config();
  config.state.frame = {{1, 2, 3}, 1.5707963267948966};
  Bench bench(config);
  bench.controller.state.p_WB = {5, 0, 0};
  bench.run(100ms);
  ASSERT_TRUE(bench.autopilot.state());
  EXPECT_LE((bench.autopilot.state()->state.p_WB - Eigen::Vector3d(1, 7, 3)).norm(), 1e-5);
}

TEST(Px4Autopilot, StampsThatAreOffAreRefusedAndToldWithTheFigure) {
  for (const Stamp off : {Stamp(-40ms), Stamp(-500ms), Stamp(40ms), Stamp(500ms)}) {
    Bench bench(bench_config());
    bench.controller.stamps_off = off;
    bench.run(500ms);
    EXPECT_FALSE(bench.autopilot.state()) << off.count();
    EXPECT_EQ(bench.report().clock, off < Stamp{0} ? StampCheck::Trouble::kLate : StampCheck::Trouble::kEarly);
    EXPECT_EQ(bench.report().least_age, -off);
    bench.controller.stamps_off = {};
    bench.run(3s);
    EXPECT_TRUE(bench.autopilot.state()) << "the clock was found";
    EXPECT_EQ(bench.report().clock, StampCheck::Trouble::kNone);
  }
}

TEST(Px4Autopilot, StampsSinceBootAreToldAndFlownByArrival) {
  auto config = bench_config();
  {
    Bench bench(config);
    bench.controller.stamps_since_boot = true;
    bench.run(500ms);
    EXPECT_FALSE(bench.autopilot.state());
    EXPECT_EQ(bench.report().clock, StampCheck::Trouble::kSinceBoot);
  }
  config.stamps = Stamps::kArrival;
  config.link_delay = 3ms;
  Bench bench(config);
  bench.controller.stamps_since_boot = true;
  bench.run(505ms);
  ASSERT_TRUE(bench.autopilot.state());
  EXPECT_EQ(bench.report().clock, StampCheck::Trouble::kNone);
  EXPECT_GE(bench.now() - bench.autopilot.state()->stamp, 3ms);
}

TEST(Px4Autopilot, AStampThatGoesBackCostsItsOwnState) {
  Bench bench(bench_config());
  bench.run(200ms);
  const auto before = bench.autopilot.state().value();
  px4::VehicleOdometry late;
  late.timestamp = late.timestamp_sample = static_cast<std::uint64_t>((bench.wall() - 15ms) / 1us);
  late.position = {50, 50, 50};
  bench.controller.send(late);
  EXPECT_EQ(bench.autopilot.state()->stamp, before.stamp);
  EXPECT_EQ(bench.report().no_state, NoState::kNotRising);
  bench.run(20ms);
  EXPECT_GT(bench.autopilot.state()->stamp, before.stamp);
}

TEST(Px4Autopilot, AFailedEstimateGivesNoState) {
  Bench bench(bench_config());
  bench.controller.bends = [](px4::Message* message) {
    if (auto* odometry = std::get_if<px4::VehicleOdometry>(message)) odometry->quality = -1;
  };
  bench.run(200ms);
  EXPECT_FALSE(bench.autopilot.state());
  EXPECT_EQ(bench.report().no_state, NoState::kQuality);
}

// ---- status --------------------------------------------------------------------------------------------------------

TEST(Px4Autopilot, SaysWhatPx4Says) {
  auto config = bench_config();
  config.arm_by_command = false;
  config.radio = {.arm = 5, .take_over = 6, .kill = 7};
  Bench bench(config);
  EXPECT_FALSE(bench.autopilot.status(bench.now()));
  bench.controller.radio_us[5] = 1900;
  bench.controller.battery_v = 14.5;
  bench.controller.specific_force_z = 12.0;
  bench.run(1200ms);
  const auto status = bench.status();
  EXPECT_FALSE(status.armed || status.follows_us || status.own_failsafe);
  EXPECT_EQ(status.on_ground, true);
  ASSERT_TRUE(status.pilot);
  EXPECT_FALSE(status.pilot->arm || status.pilot->kill);
  EXPECT_TRUE(status.pilot->take_over);
  EXPECT_EQ(status.battery_v, 14.5);
  EXPECT_EQ(status.specific_force_z_m_s2, 12.0);
  EXPECT_TRUE(status.q_WB);
  EXPECT_EQ(status.failsafe, flight::FirmwareFailsafe::kNotChecked);
  EXPECT_LE(bench.now() - status.stamp, 10ms);
}

TEST(Px4Autopilot, ARadioThatIsLostIsNotAPerson) {
  auto config = bench_config();
  config.arm_by_command = false;
  config.radio.arm = 5;
  Bench bench(config);
  bench.run(300ms);
  EXPECT_TRUE(bench.status().pilot);
  bench.controller.radio_channels = 0;
  bench.run(150ms);
  EXPECT_FALSE(bench.status().pilot);
}

TEST(Px4Autopilot, KnobsOfManualControlAreSwitchesWhereSaid) {
  auto config = bench_config();
  config.arm_by_command = false;
  config.radio_from = RadioFrom::kManualControl;
  config.radio = {.arm = 1, .take_over = 2, .kill = 6};
  Bench bench(config);
  bench.run(300ms);
  EXPECT_FALSE(bench.status().pilot) << "the radio's channels are not asked";
  px4::ManualControlSetpoint message;
  message.timestamp = 1;
  message.valid = true;
  message.aux = {1, -1, px4::kNoKnob, px4::kNoKnob, px4::kNoKnob, px4::kNoKnob};
  bench.controller.send(message);
  ASSERT_TRUE(bench.status().pilot);
  EXPECT_TRUE(bench.status().pilot->arm);
  EXPECT_FALSE(bench.status().pilot->take_over || bench.status().pilot->kill);
  message.valid = false;
  bench.controller.send(message);
  EXPECT_FALSE(bench.status().pilot);
}

TEST(Px4Autopilot, WithoutItsStatusPx4IsNotHeardWhateverElseComes) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.controller.bends = [](px4::Message* message) {
    if (auto* status = std::get_if<px4::VehicleStatus>(message)) status->system_id = 77;
  };
  bench.run(5s);
  EXPECT_GE(bench.now() - bench.status().stamp, 2s);
}

TEST(Px4Autopilot, SilenceIsSeenInTheStamp) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.controller.silent = true;
  bench.run(1s);
  EXPECT_GE(bench.now() - bench.status().stamp, 990ms);
}

// ---- what is wanted ------------------------------------------------------------------------------------------------

TEST(Px4Autopilot, EntersOffboardAfterASecondOfSetpointsThenArms) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(900ms, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.commands.empty());
  EXPECT_TRUE(bench.controller.mode->body_rate);
  EXPECT_FALSE(bench.controller.mode->position || bench.controller.mode->velocity ||
               bench.controller.mode->acceleration || bench.controller.mode->attitude ||
               bench.controller.mode->thrust_and_torque || bench.controller.mode->direct_actuator);
  bench.fly(2s, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.follows());
  EXPECT_TRUE(bench.controller.armed());
  ASSERT_EQ(bench.controller.commands.size(), 2U);
  const px4::VehicleCommand& mode = bench.controller.commands[0];
  EXPECT_EQ(mode.command, 176U);
  EXPECT_EQ(mode.param1, 1.0F);
  EXPECT_EQ(mode.param2, 6.0F);
  EXPECT_EQ(mode.target_system, 1);
  EXPECT_EQ(mode.source_component, 191);
  EXPECT_TRUE(mode.from_external);
  EXPECT_EQ(bench.controller.commands[1].command, 400U);
  const auto status = bench.status();
  EXPECT_TRUE(status.armed && status.follows_us);
}

TEST(Px4Autopilot, SetpointsAreTurnedIntoFrd) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(20ms, 0.25, {1, 2, 3});
  const auto& target = bench.controller.target.value();
  EXPECT_EQ(target.timestamp, 0U) << "PX4 stamps it when it arrives";
  EXPECT_EQ(target.roll, 1.0F);
  EXPECT_EQ(target.pitch, -2.0F);
  EXPECT_EQ(target.yaw, -3.0F);
  EXPECT_EQ(target.thrust_body, (std::array<float, 3>{0, 0, -0.25F}));
}

TEST(Px4Autopilot, SetpointsOutOfRangeAreNotSent) {
  Bench bench(bench_config());
  bench.run(300ms);
  for (const double throttle : {-0.1, 1.1, std::nan("")})
    bench.autopilot.send_setpoint(bench.now(), {0, 0, 0}, throttle);
  bench.autopilot.send_setpoint(bench.now(), {std::nan(""), 0, 0}, 0.5);
  bench.autopilot.send_setpoint(bench.now(), {0, INFINITY, 0}, 0.5);
  EXPECT_FALSE(bench.controller.target);
  EXPECT_EQ(bench.report().refused_setpoints, 5U);
}

TEST(Px4Autopilot, ThePersonsSwitchArmsWhereThatIsConfigured) {
  auto config = bench_config();
  config.arm_by_command = false;
  config.radio.arm = 5;
  Bench bench(config);
  bench.run(300ms);
  bench.fly(3s, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.follows());
  EXPECT_EQ(bench.commands(Command::kArmDisarm), 0);
}

TEST(Px4Autopilot, RefusedCommandsAreToldAndTriedAgain) {
  Bench bench(bench_config());
  bench.controller.refuses[400] = CommandResult::kTemporarilyRejected;
  bench.run(300ms);
  bench.fly(5s, 0, {0, 0, 0});
  EXPECT_EQ(bench.report().arming.kind, CommandFate::Kind::kRefused);
  EXPECT_EQ(bench.report().arming.result, CommandResult::kTemporarilyRejected);
  EXPECT_GE(bench.commands(Command::kArmDisarm), 3);
  EXPECT_LE(bench.commands(Command::kArmDisarm), 5);
  bench.controller.refuses.clear();
  bench.fly(2s, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.armed());
}

TEST(Px4Autopilot, UnansweredCommandsAreSentAgainWithTheirCount) {
  Bench bench(bench_config());
  bench.controller.overhears[176] = 2;
  bench.run(300ms);
  bench.fly(4s, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.armed());
  EXPECT_EQ(bench.controller.commands[2].confirmation, 2);
}

TEST(Px4Autopilot, AnswersToOthersAreNotOurs) {
  Bench bench(bench_config());
  bench.controller.overhears[176] = 1000;
  bench.run(300ms);
  bench.fly(1100ms, 0, {0, 0, 0});
  px4::VehicleCommandAck ack;
  ack.timestamp = 1;
  ack.command = 176;
  ack.target_system = 255;
  ack.target_component = 190;
  bench.controller.send(ack);
  EXPECT_EQ(bench.report().mode.kind, CommandFate::Kind::kWaiting);
}

TEST(Px4Autopilot, DisarmsOnTheGroundAndKillsInTheAir) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(3s, 0, {0, 0, 0});
  ASSERT_TRUE(bench.controller.armed());
  bench.controller.on_ground = false;
  bench.fly(2s, 0.3, {0, 0, 0}, Wanted::kDisarmed);
  EXPECT_TRUE(bench.controller.armed()) << "it refuses in the air";
  bench.fly(500ms, 0.3, {0, 0, 0}, Wanted::kKilled);
  EXPECT_FALSE(bench.controller.armed());
  EXPECT_EQ(bench.controller.commands.back().param2, 21196.0F);
}

TEST(Px4Autopilot, AnOldWishDoesNotDisarmWhatAPersonJustArmed) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(1s, 0, {0, 0, 0}, Wanted::kDisarmed);
  bench.controller.loop().arm_switch(bench.now(), true);
  bench.run(300ms);
  EXPECT_TRUE(bench.status().armed);
  EXPECT_TRUE(bench.controller.armed()) << "nobody has told the wish again since that was heard";
  bench.fly(20ms, 0, {0, 0, 0}, Wanted::kDisarmed);
  EXPECT_FALSE(bench.controller.armed());
}

TEST(Px4Autopilot, WhoLeavesOffboardIsNotForcedBack) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(3s, 0.0, {0, 0, 0});
  ASSERT_TRUE(bench.controller.armed());
  bench.controller.leave_mode();
  const auto before = bench.controller.commands.size();
  bench.fly(3s, 0.3, {0, 0, 0});
  EXPECT_EQ(bench.controller.commands.size(), before);
  EXPECT_TRUE(bench.report().taken_away);
  EXPECT_FALSE(bench.status().follows_us);
}

TEST(Px4Autopilot, ItsFailsafeIsToldWhenSetpointsEnd) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(3s, 0.0, {0, 0, 0});
  ASSERT_TRUE(bench.controller.armed());
  for (int i = 0; i < 1000; ++i) {
    (void)bench.controller.loop().step(bench.now(), {0, 0, 0}, 1e-3);
    bench.run(1ms);
  }
  EXPECT_TRUE(bench.controller.in_failsafe());
  EXPECT_TRUE(bench.status().own_failsafe);
  EXPECT_FALSE(bench.status().follows_us);
  bench.controller.bends = [](px4::Message* message) {
    if (auto* status = std::get_if<px4::VehicleStatus>(message)) status->failsafe_and_user_took_over = true;
  };
  bench.run(300ms);
  EXPECT_FALSE(bench.status().own_failsafe) << "a person flies";
}

TEST(Px4Autopilot, WhileAStrangerSpeaksNothingIsArmed) {
  Bench bench(bench_config());
  bench.run(300ms);
  px4::VehicleStatus stranger;
  stranger.timestamp = 1;
  stranger.system_id = 2;
  stranger.arming_state = px4::kArmed;
  for (int i = 0; i < 30; ++i) {
    bench.controller.send(stranger);
    bench.fly(100ms, 0, {0, 0, 0});
  }
  EXPECT_TRUE(bench.controller.commands.empty());
  EXPECT_TRUE(bench.report().stranger);
  EXPECT_FALSE(bench.status().armed) << "that was the other one";
  bench.fly(6s, 0, {0, 0, 0});
  EXPECT_TRUE(bench.controller.armed()) << "it has gone";
}

TEST(Px4Autopilot, TheConfiguredSystemIsWaitedFor) {
  auto config = bench_config();
  config.vehicle_system = 9;
  Bench bench(config);
  bench.run(500ms);
  EXPECT_FALSE(bench.autopilot.status(bench.now()));
  bench.controller.system = 9;
  bench.run(500ms);
  EXPECT_TRUE(bench.autopilot.status(bench.now()));
}

TEST(Px4Autopilot, AllocatesNothing) {
  Bench bench(bench_config());
  bench.run(300ms);
  bench.fly(3s, 0.3, {0.1, 0, 0});
  px4::VehicleOdometry odometry;
  odometry.timestamp = odometry.timestamp_sample = static_cast<std::uint64_t>(bench.wall() / 1us);
  const px4::Message message = odometry;
  const test::AllocationTrap trap;
  bench.autopilot.on_message({bench.now(), bench.wall()}, message);
  (void)bench.autopilot.status(bench.now());
  (void)bench.autopilot.report(bench.now());
  EXPECT_EQ(trap.count(), 0U);
}

}  // namespace
}  // namespace gatefield::bridge
