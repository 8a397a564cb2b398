#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "client/bridge/autopilot_ports.h"
#include "client/bridge/px4/autopilot.h"
#include "client/bridge/px4/report.h"
#include "client/bridge/vehicle.h"
#include "client/flight/clock.h"
#include "client/flight/thrust_estimate.h"
#include "common/base/mailbox.h"
#include "common/dds/px4/endpoint.h"

namespace gatefield::bridge {

/// A vehicle behind PX4 on the bus: the loop's ports over px4::Endpoint.
///
/// Messages come on threads of the middleware, which leave the newest of each kind, with the time of its arrival, in a
/// mailbox; the loop's thread takes them up when it asks for a state and every kTick while it waits (the vehicle is the
/// loop's clock).
///
/// Throttle is made of newtons by thrust().
/// Thread-safe: no; one thread at a time, beside the middleware's.   Real-time safe: the ports and the clock are
/// (system calls, no allocation).
class Px4Vehicle final : public Vehicle, private flight::LoopClock, private px4::Handler, private Px4Outlet {
 public:
  /// Joins PX4's domain and waits for PX4.
  /// Errors: those of validate(config) and px4::Endpoint::create(); kNoAnswer when nothing of PX4 comes within
  /// connect_timeout, with what is on the bus instead (another release, another namespace) and the next step.
  /// @param cancel  when it becomes true, waiting ends as if nothing more had been heard; null: nothing ends it early
  /// @param clock   by which it lives, read on the middleware's threads, too: the machine's, or that of a simulation
  ///                that PX4 runs by in lockstep (with stamps of Stamps::kArrival)
  static Result<std::unique_ptr<Px4Vehicle>> open(
      const Px4Config& config, const std::atomic<bool>* cancel = nullptr,
      std::unique_ptr<flight::LoopClock> clock = std::make_unique<flight::RealTimeClock>());
  /// @pre validate(config)
  explicit Px4Vehicle(const Px4Config& config,
                      std::unique_ptr<flight::LoopClock> clock = std::make_unique<flight::RealTimeClock>());
  ~Px4Vehicle() override;

  flight::StateSource* states() noexcept override { return &ports_.states(); }
  flight::Actuator& actuator() noexcept override { return ports_.actuator(); }
  flight::FlightController& flight_controller() noexcept override { return ports_.flight_controller(); }
  flight::LoopClock* clock() noexcept override { return this; }

  /// As in report.h.
  std::vector<std::string> description() const override;
  std::vector<std::string> complaints() const override;
  Px4Report report() const noexcept { return autopilot_.report(now()); }
  /// Learns of the thrust in flight; the bridge gives it the states (flight::Supervision).
  flight::ThrustEstimate& thrust() noexcept { return thrust_; }

  /// Takes up what comes, for `span`. No setpoint is sent.
  void keep_alive(std::chrono::nanoseconds span) noexcept { sleep_until(now() + span); }

 private:
  using Ports = AutopilotPorts<Px4Vehicle, Px4Autopilot>;
  friend Ports;  // which pump, and ask for the time

  Status connect(const std::atomic<bool>* cancel);
  BusReport bus_report() const;

  Stamp now() const noexcept override { return clock_->now(); }
  Stamp sleep_until(Stamp deadline) noexcept override;
  void pump() noexcept;

  // on the middleware's threads
  void on_message(const px4::Message& message) override;
  void on_rejected(std::string_view topic, const Error& why) override;

  void send(const px4::OffboardControlMode& message) noexcept override { publish(message); }
  void send(const px4::VehicleRatesSetpoint& message) noexcept override { publish(message); }
  void send(const px4::VehicleCommand& message) noexcept override { publish(message); }
  template <typename Kind>
  void publish(const Kind& message) noexcept {
    if (!endpoint_ || !endpoint_->publish(message)) ++not_sent_;
  }

  template <typename Kind>
  struct Arrived {
    Arrival at;
    Kind message;
  };
  template <typename Variant>
  struct Boxes;
  template <typename... Kinds>
  struct Boxes<std::variant<Kinds...>> {
    std::tuple<Mailbox<Arrived<Kinds>>...> all;
  };

  static constexpr Stamp kTick{std::chrono::milliseconds(2)};

  const Px4Config config_;
  const std::unique_ptr<flight::LoopClock> clock_;
  Px4Autopilot autopilot_;
  flight::ThrustEstimate thrust_;
  Ports ports_{this, &autopilot_, config_.setpoint_rate_hz, config_.quadrotor, &thrust_};
  std::uint64_t not_sent_ = 0;

  Boxes<px4::Message> boxes_;  // each: written on its topic's thread, read on the loop's
  mutable std::mutex rejected_mutex_;
  std::uint64_t rejected_ = 0;
  std::optional<Error> why_rejected_;
  std::unique_ptr<px4::Endpoint> endpoint_;  // last: its threads end before the rest goes
};

}  // namespace gatefield::bridge
