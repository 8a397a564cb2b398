#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bridge/autopilot_ports.h"
#include "client/bridge/mavlink/autopilot.h"
#include "client/bridge/vehicle.h"
#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/flight/clock.h"
#include "client/flight/ports.h"
#include "client/flight/thrust_estimate.h"

namespace gatefield::bridge {

/// A vehicle behind an autopilot that speaks MAVLink: the loop's ports over one link.
///
/// There is no thread: the link is read when the loop asks for the newest state and, better, while it waits. For that
/// the vehicle is the loop's clock, too: sleep_until() waits for the link, so that answers about time are heard within
/// microseconds. A loop with another clock hears them up to a period late, and half of that goes into the stamps.
/// Outside a loop keep_alive() does it.
///
/// Throttle is made of newtons by thrust().
/// Thread-safe: no; one thread at a time.   Real-time safe: the ports and the clock are (system calls, no allocation).
class MavlinkVehicle final : public Vehicle, private flight::LoopClock, private Outlet {
 public:
  /// Opens the link, waits for the autopilot's heartbeat, reads its parameters and compares clocks.
  /// Errors: those of validate(config) and firmware::open(); kNoAnswer when no heartbeat comes within connect_timeout;
  /// kInvalid when it is another firmware's or GUID_OPTIONS is not as it has to be; each with the next step.
  /// @param cancel  when it becomes true, waiting ends as if nothing more had been heard; null: nothing ends it early
  static Result<std::unique_ptr<MavlinkVehicle>> open(const MavlinkConfig& config,
                                                      const std::atomic<bool>* cancel = nullptr);
  /// Over a link that is there, and a clock of one's own. @pre validate(config)
  MavlinkVehicle(const MavlinkConfig& config, std::unique_ptr<firmware::Link> link, std::unique_ptr<Clock> clock);
  /// Waits for the autopilot as open() does.
  Status connect(const std::atomic<bool>* cancel = nullptr);

  flight::StateSource* states() noexcept override { return &ports_.states(); }
  flight::Actuator& actuator() noexcept override { return ports_.actuator(); }
  flight::FlightController& flight_controller() noexcept override { return ports_.flight_controller(); }
  flight::LoopClock* clock() noexcept override { return this; }

  /// As in report.h.
  std::vector<std::string> description() const override;
  std::vector<std::string> complaints() const override;
  AutopilotReport report() const noexcept { return autopilot_.report(clock_->now()); }
  /// Learns of the thrust in flight; the bridge gives it the states (flight::Supervision).
  flight::ThrustEstimate& thrust() noexcept { return thrust_; }

  /// Reads the link and answers what is to be answered, for `span`. No setpoint is sent.
  void keep_alive(std::chrono::nanoseconds span) noexcept { sleep_until(now() + span); }

 private:
  using Ports = AutopilotPorts<MavlinkVehicle, Autopilot>;
  friend Ports;  // which pump, and ask for the time

  Stamp now() const noexcept override { return clock_->now(); }
  Stamp sleep_until(Stamp deadline) noexcept override;

  void send(const mavlink::Message& message) noexcept override;
  void pump() noexcept;

  static constexpr int kMostReads = 64;  // in one go, so that a flood does not hold up the loop
  static constexpr Stamp kTick{std::chrono::milliseconds(5)};

  const MavlinkConfig config_;
  const bool datagrams_;
  std::unique_ptr<firmware::Link> link_;
  std::unique_ptr<Clock> clock_;
  mavlink::FrameReader reader_;
  Autopilot autopilot_;
  flight::ThrustEstimate thrust_;
  Ports ports_{this, &autopilot_, config_.setpoint_rate_hz, config_.quadrotor, &thrust_};
  std::array<std::uint8_t, firmware::Link::kMaxMessage> buffer_{};
  std::uint8_t sequence_ = 0;
  std::uint64_t not_sent_ = 0;  // messages for which the link had no room
  std::optional<firmware::Transfer> broken_;
};

}  // namespace gatefield::bridge
