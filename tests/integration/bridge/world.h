#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <utility>

#include "client/flight/clock.h"
#include "tests/support/rate_body.h"

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
    if (!arm_switch) {
      if (has_armed_) controller_->loop().arm_switch(now, false);
      has_armed_ = false;
    } else if (!has_armed_) {  // it arms as soon as it may, once
      controller_->loop().arm_switch(now, true);
      has_armed_ = controller_->armed();
    }
  }

  void move(Stamp now) {
    constexpr double kStep_s = 1e-3;
    body_.step(controller_->loop().step(now, body_.state.w_WB_B, kStep_s), kStep_s);
    controller_->state = body_.state;
    controller_->on_ground = body_.on_ground;
    controller_->specific_force_z = body_.specific_force_B.z();
    highest_m = std::max<double>(highest_m, body_.state.p_WB.z());
    passed = body_.passed;
  }

  RateBody body_;
  const std::unique_ptr<Controller> controller_;
  const std::function<void(Controller*, Stamp)> serve_;
  bool has_armed_ = false;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace gatefield::test
