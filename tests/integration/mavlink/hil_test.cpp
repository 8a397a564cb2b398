// A simulated vehicle whose firmware (ours, tests/support/hil_firmware.h) takes its sensors from the simulator and its
// setpoints from the bridge: both MAVLink links at once, in lockstep and in the test's time.

#include <gtest/gtest.h>

#include <algorithm>

#include "client/bridge/mavlink/vehicle.h"
#include "client/firmware/px4_hil/hil_link.h"
#include "tests/support/borrowed_clock.h"
#include "tests/support/hil_firmware.h"
#include "tests/support/link_pair.h"
#include "tests/support/towards.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;

class Hil : public testing::Test {
 protected:
  Hil() {
    config_.link = "tcp:127.0.0.1:5760";
    config_.arm_by_command = true;
    config_.setpoint_rate_hz = 200;
    config_.state_rate_hz = 200;
    config_.quadrotor.rotor_spin = {-1, -1, 1, 1};  // PX4's: the first two turn counter-clockwise
    config_.thrust.hover_throttle = 0.43;
    bridge_cable_->on_wait = [this](std::chrono::nanoseconds) { step(); };
    simulator_cable_->on_wait = [this](std::chrono::nanoseconds timeout) {
      clock_.advance(firmware_->hangs ? timeout : 0ns);
      firmware_->serve(clock_.now());
    };
    controller_ = std::make_unique<test::MavlinkController>(std::make_unique<test::CableEnd>(bridge_cable_, false),
                                                            Dialect::kPx4);
    firmware_ = std::make_unique<test::HilFirmware>(std::make_unique<test::CableEnd>(simulator_cable_, false),
                                                    controller_.get());
    hil_ = std::make_unique<firmware::HilLink>(firmware::HilOptions{},
                                               std::make_unique<test::CableEnd>(simulator_cable_, true),
                                               std::make_unique<test::BorrowedClock>(clock_));
    vehicle_ = std::make_unique<MavlinkVehicle>(config_, std::make_unique<test::CableEnd>(bridge_cable_, true),
                                                std::make_unique<test::BorrowedClock>(clock_));
  }

  /// Four milliseconds of the simulated world.
  void step() {
    constexpr double kStep_s = 0.004;
    clock_.advance(4ms);
    const auto motors =
        hil_->exchange(sensors_.sample(clock_.now(), motion()), sensors_.satellites(clock_.now(), motion()),
                       sensors_.truth(clock_.now(), motion()));
    failure_ = motors ? Status() : Status(motors.failure());
    firmware_->serve(clock_.now());
    controller_->serve(clock_.now());
    if (!motors) return;
    for (std::size_t i = 0; i < 4; ++i)
      state_.thrust_command_n[static_cast<Eigen::Index>(i)] =
          config_.quadrotor.thrust_max_n * motors->outputs[i] * motors->outputs[i];
    const Eigen::Vector3d before = state_.v_WB;
    for (int i = 0; i < 4; ++i) state_ = step_reference(config_.quadrotor, state_, ThrustRates::Zero(), kStep_s / 4);
    if (state_.p_WB.z() <= 0.0) {
      state_.p_WB.z() = 0.0;
      state_.v_WB = Eigen::Vector3d(0, 0, std::max(state_.v_WB.z(), 0.0));
      state_.w_WB_B.setZero();
    }
    force_W_ = (state_.v_WB - before) / kStep_s + Eigen::Vector3d(0, 0, kGravity_m_s2);
  }

  firmware::Motion motion() const {
    return {state_.p_WB, state_.v_WB, state_.q_WB, state_.w_WB_B, Eigen::Quaterniond(state_.q_WB).inverse() * force_W_};
  }

  /// The bridge's loop; a goal, or nothing to fly to yet.
  void fly(Stamp span, const std::optional<Eigen::Vector3d>& goal) {
    for (const Stamp end = clock_.now() + span; clock_.now() < end && failure_.ok();
         vehicle_->clock()->sleep_until(clock_.now() + vehicle_->actuator().period())) {
      const auto state = vehicle_->states()->newest(clock_.now());
      vehicle_->flight_controller().want(clock_.now(), flight::Wanted::kArmed);
      if (state && goal)
        vehicle_->actuator().apply(clock_.now(), test::towards(*goal, state->state, config_.quadrotor));
      else
        vehicle_->actuator().hold(clock_.now());
    }
  }

  MavlinkConfig config_;
  ManualClock clock_;
  std::shared_ptr<test::Cable> bridge_cable_ = std::make_shared<test::Cable>();
  std::shared_ptr<test::Cable> simulator_cable_ = std::make_shared<test::Cable>();
  std::unique_ptr<test::MavlinkController> controller_;
  std::unique_ptr<test::HilFirmware> firmware_;
  std::unique_ptr<firmware::HilLink> hil_;
  std::unique_ptr<MavlinkVehicle> vehicle_;
  firmware::Sensors sensors_{{}, {}};
  QuadrotorState state_;
  Eigen::Vector3d force_W_{0, 0, kGravity_m_s2};
  Status failure_;
};

TEST_F(Hil, FirmwareFliesTheSimulatedVehicleByTheBridgesSetpoints) {
  ASSERT_TRUE(vehicle_->connect().ok());
  fly(3s, std::nullopt);
  ASSERT_TRUE(controller_->armed());
  const Eigen::Vector3d goal(2, -1, 3);
  fly(10s, goal);
  ASSERT_TRUE(failure_.ok()) << failure_.error();
  EXPECT_LE((state_.p_WB - goal).norm(), 0.2) << state_.p_WB.transpose();
  EXPECT_LE(state_.v_WB.norm(), 0.2);
}

TEST_F(Hil, AFirmwareThatHangsInFlightIsToldInTime) {
  ASSERT_TRUE(vehicle_->connect().ok());
  fly(3s, std::nullopt);
  fly(3s, Eigen::Vector3d(0, 0, 2));
  ASSERT_TRUE(failure_.ok());
  ASSERT_GT(state_.p_WB.z(), 1.0);
  firmware_->hangs = true;
  const Stamp begin = clock_.now();
  fly(10s, Eigen::Vector3d(0, 0, 2));
  ASSERT_FALSE(failure_.ok());
  EXPECT_EQ(failure_.failure().code, ErrorCode::kNotAnswering);
  EXPECT_LE(clock_.now() - begin, firmware::HilOptions{}.answer_timeout + 100ms);
}

}  // namespace
}  // namespace gatefield::bridge
