#pragma once

#include <cstdint>
#include <optional>

#include "client/bridge/mavlink/commands.h"
#include "client/bridge/mavlink/odometer.h"
#include "client/bridge/mavlink/pursuit.h"
#include "client/bridge/px4/config.h"
#include "client/bridge/px4/stamp_check.h"
#include "client/flight/ports.h"
#include "common/dds/px4/messages.h"

namespace gatefield::bridge {

/// Where messages to PX4 go out.
class Px4Outlet {
 public:
  virtual ~Px4Outlet() = default;
  virtual void send(const px4::OffboardControlMode& message) noexcept = 0;
  virtual void send(const px4::VehicleRatesSetpoint& message) noexcept = 0;
  virtual void send(const px4::VehicleCommand& message) noexcept = 0;
};

/// What is known of PX4 at a time; plain data.
struct Px4Report {
  std::optional<px4::VehicleStatus> status;  ///< its newest; empty: none yet
  Stamp silent_for{0};                       ///< since anything of it was heard
  Stamp status_age{0};                       ///< since its status was heard
  bool stranger = false;                     ///< another vehicle speaks on the same topics
  std::uint8_t stranger_system = 0;          ///< its number
  StampCheck::Trouble clock = StampCheck::Trouble::kNone;
  Stamp least_age{0}, own_error{0}, round_trip{0};
  std::uint64_t states = 0;
  NoState no_state = NoState::kNotPaired;  ///< why the newest odometry was no state
  Stamp wrong_age{0};                      ///< as of Odometer
  CommandFate mode, arming;
  bool taken_away = false;              ///< as Pursuit
  std::uint64_t refused_setpoints = 0;  ///< not finite or out of range, so not sent
};

/// PX4 behind its uXRCE-DDS agent, as a machine without clock, thread or bus: messages and ticks go in, messages and
/// states come out.
///
///   - The first VehicleStatus (of the configured system, where one is configured) makes its sender the one that is
///     flown. While another system speaks on the same topics nothing is armed, since states don't say whose they are.
///   - A setpoint is sent as OffboardControlMode and VehicleRatesSetpoint, stamped 0: PX4 stamps it when it arrives.
///   - Commands are MAVLink's: mode 176 (1, 6: OFFBOARD), then arm 400; disarming by force kills.
///   - Its status comes twice a second at least. Without it for kStatusLost, PX4 counts as not heard, whatever else
///     comes.
/// PX4's parameters can't be read this way, so its failsafe is never known to be good (FirmwareFailsafe::kNotChecked).
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; the report says what is wrong.
class Px4Autopilot {
 public:
  static constexpr Stamp kStatusLost{std::chrono::milliseconds(2500)};
  static constexpr Stamp kLandLost{std::chrono::seconds(3)};  ///< PX4 tells it once a second at least
  static constexpr Stamp kRadioLost{std::chrono::seconds(1)};
  static constexpr Stamp kFeltLost{std::chrono::milliseconds(200)};  ///< accelerometer, attitude
  static constexpr Stamp kStrangerGone{std::chrono::seconds(3)};

  /// @pre validate(config)
  Px4Autopilot(const Px4Config& config, Px4Outlet* outlet) noexcept;

  /// @pre validate(message)
  void on_message(const Arrival& at, const px4::Message& message) noexcept;
  /// As FlightController::want(), by Pursuit; armed by us where that is configured. Nothing is asked for between two
  /// calls: what was heard since the last one may change the wish.
  void want(Stamp now, flight::Wanted wanted) noexcept;
  /// @param body_rates_B  FLU, rad/s   @param throttle  0 to 1
  void send_setpoint(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept;

  const std::optional<flight::TimedState>& state() const noexcept { return odometer_.newest(); }
  /// Empty: no status yet.
  std::optional<flight::ControllerStatus> status(Stamp now) const noexcept;
  Px4Report report(Stamp now) const noexcept;

 private:
  void on(const Arrival& at, const px4::VehicleOdometry& message) noexcept;
  void on(const Arrival& at, const px4::VehicleStatus& message) noexcept;
  void on(const Arrival& at, const px4::VehicleCommandAck& message) noexcept;
  void on(const Arrival& at, const px4::VehicleLandDetected& message) noexcept;
  void on(const Arrival& at, const px4::SensorCombined& message) noexcept;
  void on(const Arrival& at, const px4::TimesyncStatus& message) noexcept;
  void on(const Arrival& at, const px4::ManualControlSetpoint& message) noexcept;
  void on(const Arrival& at, const px4::InputRc& message) noexcept;
  void on(const Arrival& at, const px4::BatteryStatus& message) noexcept;

  void pursue(Stamp now) noexcept;
  void command(Stamp now, const mavlink::CommandLong& wanted) noexcept;
  bool armed() const noexcept;
  bool follows() const noexcept;
  bool stranger(Stamp now) const noexcept;

  template <typename Value>
  struct Heard {
    Stamp at{0};
    Value value;
  };

  Px4Config config_;
  Px4Outlet* outlet_;
  StampCheck stamps_;
  Odometer odometer_;
  CommandDesk desk_;
  Pursuit pursuit_;

  std::optional<Stamp> heard_;
  std::optional<Heard<px4::VehicleStatus>> status_;
  std::optional<Heard<std::uint8_t>> stranger_;
  std::optional<Heard<flight::PilotSwitches>> pilot_;
  std::optional<Heard<double>> force_z_;
  std::optional<Heard<bool>> landed_;
  std::optional<Stamp> attitude_at_;
  std::optional<double> battery_v_;
  NoState no_state_ = NoState::kNotPaired;
  std::uint64_t refused_setpoints_ = 0;
};

}  // namespace gatefield::bridge
