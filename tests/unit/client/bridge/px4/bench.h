#pragma once

#include <algorithm>
#include <memory>

#include "client/bridge/px4/autopilot.h"
#include "tests/support/px4_controller.h"

namespace gatefield::bridge {

/// Px4Autopilot and Px4Controller, in the test's time: messages arrive at once.
class Bench final : private Px4Outlet {
 public:
  explicit Bench(const Px4Config& config)
      : autopilot(config, this), controller([this](const px4::Message& message) {
          autopilot.on_message({clock.now(), wall()}, message);
        }) {}

  Stamp now() const { return clock.now(); }
  /// This machine's wall clock.
  Stamp wall() const { return Stamp(std::chrono::hours(24 * 365 * 56)) + clock.now(); }

  void run(Stamp span) {
    for (const Stamp end = now() + span; now() < end;) pass();
  }
  /// Setpoints as a loop sends them, for `span`.
  void fly(Stamp span, double throttle, const Eigen::Vector3d& rates_B,
           flight::Wanted wanted = flight::Wanted::kArmed) {
    for (const Stamp end = now() + span; now() < end; run(std::chrono::milliseconds(10))) {
      autopilot.want(now(), wanted);
      autopilot.send_setpoint(now(), rates_B, throttle);
    }
  }
  flight::ControllerStatus status() const { return autopilot.status(now()).value(); }
  Px4Report report() const { return autopilot.report(now()); }
  int commands(mavlink::Command command) const {
    return static_cast<int>(
        std::ranges::count(controller.commands, static_cast<std::uint32_t>(command), &px4::VehicleCommand::command));
  }

  ManualClock clock;
  Px4Autopilot autopilot;
  test::Px4Controller controller;

 private:
  void pass() {
    clock.advance(std::chrono::milliseconds(1));
    controller.serve(now(), wall());
  }
  void send(const px4::OffboardControlMode& message) noexcept override { controller.hear(now(), message); }
  void send(const px4::VehicleRatesSetpoint& message) noexcept override { controller.hear(now(), message); }
  void send(const px4::VehicleCommand& message) noexcept override { controller.hear(now(), message); }
};

/// A vehicle that may be armed by the bridge.
inline Px4Config bench_config() {
  Px4Config config;
  config.arm_by_command = true;
  return config;
}

}  // namespace gatefield::bridge
