#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <string>

#include "client/bridge/mavlink/vehicle.h"
#include "tests/support/borrowed_clock.h"
#include "tests/support/link_pair.h"
#include "tests/support/mavlink_controller.h"

namespace gatefield::bridge {

/// MavlinkVehicle and MavlinkController on a cable, in the test's time: whenever the vehicle waits, a millisecond goes
/// by on the other side, with a rigid body that the controller's motors move where a test asks for it.
class Bench {
 public:
  explicit Bench(const MavlinkConfig& config) : config_(config) {
    controller =
        std::make_unique<test::MavlinkController>(std::make_unique<test::CableEnd>(cable, false), config.dialect);
    cable->on_wait = [this](std::chrono::nanoseconds timeout) { pass(timeout); };
    vehicle = std::make_unique<MavlinkVehicle>(config, std::make_unique<test::CableEnd>(cable, true),
                                               std::make_unique<test::BorrowedClock>(clock));
  }

  Stamp now() const { return clock.now(); }
  void run(Stamp span) { vehicle->keep_alive(span); }
  /// Setpoints as a loop sends them, for `span`.
  void fly(Stamp span, double collective_n, const Eigen::Vector3d& rates_B,
           flight::Wanted wanted = flight::Wanted::kArmed) {
    sdk::Setpoint setpoint;
    setpoint.collective_thrust_n = collective_n;
    setpoint.body_rates_rad_s = rates_B;
    for (const Stamp end = now() + span; now() < end;
         vehicle->clock()->sleep_until(now() + vehicle->actuator().period())) {
      (void)vehicle->states()->newest(now());
      vehicle->flight_controller().want(now(), wanted);
      vehicle->actuator().apply(now(), setpoint);
    }
  }
  void hold(Stamp span, flight::Wanted wanted) {
    for (const Stamp end = now() + span; now() < end;
         vehicle->clock()->sleep_until(now() + vehicle->actuator().period())) {
      (void)vehicle->states()->newest(now());
      vehicle->flight_controller().want(now(), wanted);
      vehicle->actuator().hold(now());
    }
  }
  flight::ControllerStatus status() { return vehicle->flight_controller().newest(now()).value(); }
  bool complains_of(const std::string& words) const {
    const auto sentences = vehicle->complaints();
    return std::any_of(sentences.begin(), sentences.end(),
                       [&](const std::string& s) { return s.find(words) != std::string::npos; });
  }
  int commands(mavlink::Command command) const {
    return static_cast<int>(std::count_if(controller->commands.begin(), controller->commands.end(), [&](const auto& c) {
      return c.command == static_cast<std::uint16_t>(command);
    }));
  }

  ManualClock clock;
  std::shared_ptr<test::Cable> cable = std::make_shared<test::Cable>();
  std::unique_ptr<test::MavlinkController> controller;
  std::unique_ptr<MavlinkVehicle> vehicle;
  bool moves = false;  ///< the motors move the vehicle

 private:
  void pass(std::chrono::nanoseconds timeout) {
    clock.advance(std::min<std::chrono::nanoseconds>(timeout, std::chrono::milliseconds(1)));
    if (moves) move(seconds(std::min<std::chrono::nanoseconds>(timeout, std::chrono::milliseconds(1))));
    controller->serve(now());
  }

  /// Outputs to thrust by a square, and the rigid body on a floor.
  void move(double dt_s) {
    QuadrotorState& state = controller->state;
    const auto outputs = controller->loop().step(now(), state.w_WB_B, dt_s);
    constexpr std::array<std::size_t, 4> kOutputOfRotor{1, 2, 3, 0};  // front right, rear left, front left, rear right
    for (std::size_t i = 0; i < 4; ++i)
      state.thrust_command_n[static_cast<Eigen::Index>(i)] =
          config_.quadrotor.thrust_max_n * outputs[kOutputOfRotor[i]] * outputs[kOutputOfRotor[i]];
    const Eigen::Vector3d before = state.v_WB;
    state = step_reference(config_.quadrotor, state, ThrustRates::Zero(), dt_s);
    controller->on_ground = state.p_WB.z() <= 0.0;
    if (controller->on_ground) {
      state.p_WB.z() = 0.0;
      state.v_WB = state.v_WB.cwiseMax(Eigen::Vector3d(0, 0, 0)).cwiseProduct(Eigen::Vector3d::UnitZ());
      state.w_WB_B.setZero();
    }
    const Eigen::Vector3d force_W = (state.v_WB - before) / dt_s + Eigen::Vector3d(0, 0, kGravity_m_s2);
    controller->specific_force_z = (Eigen::Quaterniond(state.q_WB).inverse() * force_W).z();
  }

  MavlinkConfig config_;
};

/// A vehicle that may be armed by the bridge, on a link in memory.
inline MavlinkConfig bench_config(Dialect dialect) {
  MavlinkConfig config;
  config.link = "tcp:127.0.0.1:5760";  // a stream of bytes, as the cable is
  config.dialect = dialect;
  config.arm_by_command = true;
  config.quadrotor.rotor_spin = {-1, -1, 1, 1};  // as test::RateController's mixer has them
  return config;
}

}  // namespace gatefield::bridge
