#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client/firmware/link/link.h"
#include "client/firmware/mavlink/frame_reader.h"
#include "client/firmware/px4_hil/hil_motors.h"
#include "client/firmware/px4_hil/hil_options.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::firmware {

/// A flight controller on a serial port that takes its sensors from a simulator over MAVLink (PX4's SYS_HITL 1;
/// "Hardware in the Loop Simulation", docs.px4.io): HIL_SENSOR and HIL_GPS out, HIL_ACTUATOR_CONTROLS in, beside
/// whatever else is said on the port. It runs by its own clock and stamps samples when they arrive, so nobody waits for
/// anybody: samples go out when they are due, and its newest motors count.
///
/// HIL_STATE_QUATERNION is not sent: such a board takes the truth in it for its own attitude and position.
///
/// Told, each in a sentence with the next step: a silent port, bytes that are no MAVLink, a board that is not in HIL
/// mode or leaves it, motors that are armed and don't come, a board that starts again, a port that is gone, outputs
/// that are none of a quadrotor's. A line with noise costs the messages that it spoils; how much it spoils is told with
/// the rest.
/// Thread-safe: no.   Real-time safe: send() and hear() (system calls; allocation for what ends the flight); the rest
/// no.
class HilBoard {
 public:
  static constexpr Stamp kModeGrace{std::chrono::seconds(3)};    ///< of a heartbeat without the HIL flag, it may boot
  static constexpr Stamp kFirstMotors{std::chrono::seconds(3)};  ///< from armed to the first message of motors
  static constexpr Stamp kSilent{std::chrono::seconds(4)};       ///< of a board that is not armed

  /// Over a link that may be shared, with a clock for the time limits. @pre validate(options), is_board(options)
  HilBoard(const HilOptions& options, std::unique_ptr<Link> link, std::unique_ptr<Clock> clock);

  /// Waits for an autopilot in HIL mode; a port that starts by itself (USB) is woken by heartbeats meanwhile.
  /// Errors: kNoAnswer with field "address" when none is heard within connect_timeout; kInvalid with field "SYS_HITL"
  /// when it is not in HIL mode; those of hear().
  Status connect();

  /// What does not find room is dropped: the next sample is newer.
  /// Errors: kNotAnswering with field "address" when the port is gone.
  Status send(const mavlink::HilSensor& sensor, const std::optional<mavlink::HilGps>& gps);

  /// Takes up what came. @return its newest motors; off before the first
  /// Errors: kNotAnswering with field "address" for what is listed above; kInvalid for outputs out of range, and with
  /// field "HIL_ACT_FUNC" when its first four outputs are no motors.
  Result<HilMotors> hear();

  const mavlink::ReaderCounts& counts() const noexcept { return reader_.counts(); }

 private:
  Status send(const mavlink::Message& message);
  Status receive();
  void take(Stamp now, const mavlink::Frame& frame, const mavlink::Message& message, Status* status);
  void take(Stamp now, const mavlink::Heartbeat& heartbeat);
  Status take(Stamp now, const mavlink::HilActuatorControls& controls);
  void note_boot_time(Stamp since_boot) noexcept;
  void note_armed(Stamp now, bool armed) noexcept;
  Status check(Stamp now) const;
  Error lost(const std::string& what) const;
  Error nobody() const;
  Error not_in_hil_mode(const std::string& what) const;
  std::string condition() const;

  const HilOptions options_;
  const std::unique_ptr<Link> link_;
  const std::unique_ptr<Clock> clock_;
  mavlink::FrameReader reader_;
  HilMotors motors_;
  std::optional<mavlink::Address> peer_;
  Stamp heard_{0}, hil_at_{0}, armed_since_{0}, answered_at_{0};
  std::optional<Stamp> since_boot_;  // by its own clock, the latest
  bool hil_ = false, was_hil_ = false, armed_ = false, restarted_ = false;
  std::uint64_t received_ = 0, unsent_ = 0;
  std::array<std::uint8_t, Link::kMaxMessage> buffer_{};
  std::uint8_t sequence_ = 0;
};

}  // namespace gatefield::firmware
