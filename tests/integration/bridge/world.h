#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "client/flight/clock.h"
#include "common/vehicle/quadrotor.h"
#include "tests/support/rate_controller.h"

namespace gatefield::test {

/// An autopilot of ours, the body that its motors move, and the person's arm switch (channel 5); in real time, on a
/// thread of its own.
/// @tparam Controller  MavlinkController, Px4Controller
template <typename Controller>
class World {
 public:
  /// @param serve  hears and says what there is, every millisecond
  World(std::unique_ptr<Controller> controller, std::function<void(Controller*, Stamp)> serve)
      : controller_(std::move(controller)), serve_(std::move(serve)), thread_([this] { run(); }) {}
  ~World() { end(); }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// The autopilot dies.
  void end() {
    ending_ = true;
    if (thread_.joinable()) thread_.join();
  }

  std::atomic<bool> arm_switch{false};
  std::atomic<bool> disarms{false};  ///< the autopilot, by itself
  std::atomic<bool> passed{false};   ///< the gate of course one-gate, inside of its opening
  std::atomic<double> highest_m{0};  ///< that the vehicle was
  std::atomic<bool> armed{false}, on_ground{true};

 private:
  static constexpr Stamp kStep{std::chrono::milliseconds(1)};

  void run() {
    flight::RealTimeClock clock;
    for (Stamp due = clock.now(); !ending_; due += kStep) {
      clock.sleep_until(due);
      turn_switch(due);
      move(due);
      serve_(controller_.get(), due);
      armed = controller_->armed();
      on_ground = controller_->on_ground;
    }
  }

  /// The autopilot's own switch arms it at once; the radio's next word of that comes later than its status.
  void turn_switch(Stamp now) {
    controller_->radio_us[4] = arm_switch ? 1900 : 1000;
    if (disarms) controller_->loop().arm_switch(now, false);
    if (arm_switch == switched_on_) return;
    switched_on_ = arm_switch;
    controller_->loop().arm_switch(now, switched_on_);
  }

  void move(Stamp now) {
    constexpr double kStep_s = 1e-3;
    QuadrotorState& state = controller_->state;
    const auto outputs = controller_->loop().step(now, state.w_WB_B, kStep_s);
    constexpr std::array<std::size_t, 4> kOutputOfRotor{1, 2, 3, 0};  // front right, rear left, front left, rear right
    for (std::size_t i = 0; i < 4; ++i)
      state.thrust_command_n[static_cast<Eigen::Index>(i)] =
          model_.thrust_max_n * outputs[kOutputOfRotor[i]] * outputs[kOutputOfRotor[i]];
    const QuadrotorState before = state;
    state = step_reference(model_, state, ThrustRates::Zero(), kStep_s);
    controller_->on_ground = state.p_WB.z() <= 0.0;
    if (controller_->on_ground) {
      state.p_WB.z() = 0.0;
      state.v_WB = Eigen::Vector3d(0, 0, std::max(state.v_WB.z(), 0.0));
      state.w_WB_B.setZero();
    }
    const Eigen::Vector3d force_W = (state.v_WB - before.v_WB) / kStep_s + Eigen::Vector3d(0, 0, kGravity_m_s2);
    controller_->specific_force_z = (Eigen::Quaterniond(state.q_WB).inverse() * force_W).z();
    highest_m = std::max<double>(highest_m, state.p_WB.z());
    constexpr double kGate_x_m = 8.0, kGate_z_m = 1.5, kHalf_m = 0.5;
    if (before.p_WB.x() < kGate_x_m && state.p_WB.x() >= kGate_x_m)
      passed = std::abs(state.p_WB.y()) < kHalf_m && std::abs(state.p_WB.z() - kGate_z_m) < kHalf_m;
  }

  static QuadrotorModel model() {
    QuadrotorModel model;
    model.rotor_spin = {-1, -1, 1, 1};  // as RateController's mixer has them
    return model;
  }

  const QuadrotorModel model_ = model();
  const std::unique_ptr<Controller> controller_;
  const std::function<void(Controller*, Stamp)> serve_;
  bool switched_on_ = false;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace gatefield::test
