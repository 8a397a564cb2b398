#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "client/bridge/mavlink/commands.h"
#include "client/bridge/mavlink/config.h"
#include "client/bridge/mavlink/odometer.h"
#include "client/bridge/mavlink/parameters.h"
#include "client/bridge/mavlink/pursuit.h"
#include "client/bridge/mavlink/time_sync.h"
#include "client/firmware/mavlink/frame.h"
#include "client/flight/ports.h"

namespace gatefield::bridge {

/// Where messages go out.
class Outlet {
 public:
  virtual ~Outlet() = default;
  virtual void send(const mavlink::Message& message) noexcept = 0;
};

/// What is known of the autopilot at a time; plain data, so that it can be handed to another thread.
struct AutopilotReport {
  std::optional<mavlink::Address> peer;  ///< empty: no heartbeat of an autopilot yet
  mavlink::Heartbeat heartbeat;          ///< its newest
  Stamp silent_for{0};                   ///< since anything of it was heard
  bool wrong_firmware = false;           ///< its heartbeat names another firmware than the dialect's
  bool parameters_done = false;
  std::array<double, Parameters::kMost> parameters{};  ///< in the order of the dialect's rules; NaN: not read
  bool thrust_is_thrust = true;
  TimeSync::Trouble clock = TimeSync::Trouble::kNone;
  Stamp offset{0}, round_trip{0};
  double drift_ppm = 0.0;
  std::uint64_t clock_restarts = 0;
  std::uint64_t states = 0;
  NoState no_state = NoState::kNotPaired;  ///< why the newest message that could have been a state was none
  Stamp state_age{0}, wrong_age{0};        ///< as of Odometer
  std::uint64_t jumps = 0;
  std::uint64_t untranslated = 0;  ///< stamps that could not be translated
  CommandFate mode, arming;
  bool taken_away = false;              ///< it stopped following us while that was wanted, see Pursuit
  std::uint64_t refused_setpoints = 0;  ///< not finite or out of range, so not sent
  std::uint64_t faults = 0;
  std::optional<mavlink::Fault> fault;         ///< of the newest message that had one
  std::optional<mavlink::StatusText> warning;  ///< the newest of severity kWarning and worse
};

/// One autopilot over MAVLink, as a machine without clock, thread or socket: frames and ticks go in, messages and
/// states come out.
///
///   - Its first heartbeat makes an autopilot the peer (of the configured system, where one is configured). Others are
///     not listened to.
///   - Heartbeats of ours go out every kHeartbeat, questions for the time, and requests for the messages that states
///     and status are made of, one after the other. After kSilent without a word of it, or when its clock began anew,
///     everything is asked for again.
///   - A setpoint is sent as SET_ATTITUDE_TARGET with rates and thrust.
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; the report says what is wrong.
class Autopilot {
 public:
  static constexpr Stamp kHeartbeat{std::chrono::milliseconds(250)};
  static constexpr Stamp kSilent{std::chrono::seconds(3)};
  static constexpr Stamp kRadioLost{std::chrono::seconds(1)};
  static constexpr Stamp kFeltLost{std::chrono::milliseconds(200)};  ///< accelerometer, attitude

  /// @pre validate(config)
  Autopilot(const MavlinkConfig& config, Outlet* outlet) noexcept;

  void on_frame(Stamp now, const mavlink::Frame& frame) noexcept;
  /// Sends what is due. To be called every few milliseconds.
  void tick(Stamp now) noexcept;

  /// As FlightController::want(), by Pursuit; armed by us where that is configured. Nothing is asked for between two
  /// calls: what was heard since the last one may change the wish.
  void want(Stamp now, flight::Wanted wanted) noexcept;
  /// @param body_rates_B  FLU, rad/s   @param throttle  0 to 1
  void send_setpoint(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept;

  const std::optional<flight::TimedState>& state() const noexcept { return odometer_.newest(); }
  /// Empty: no heartbeat yet.
  std::optional<flight::ControllerStatus> status(Stamp now) const noexcept;
  AutopilotReport report(Stamp now) const noexcept;

 private:
  void on_heartbeat(mavlink::Address from, const mavlink::Heartbeat& message) noexcept;
  void on(Stamp now, const mavlink::Timesync& message) noexcept;
  void on(Stamp now, const mavlink::SystemTime& message) noexcept;
  void on(Stamp now, const mavlink::Odometry& message) noexcept;
  void on(Stamp now, const mavlink::LocalPositionNed& message) noexcept;
  void on(Stamp now, const mavlink::AttitudeQuaternion& message) noexcept;
  void on(Stamp now, const mavlink::HighresImu& message) noexcept;
  void on(Stamp now, const mavlink::SysStatus& message) noexcept;
  void on(Stamp now, const mavlink::BatteryStatus& message) noexcept;
  void on(Stamp now, const mavlink::RcChannels& message) noexcept;
  void on(Stamp now, const mavlink::ExtendedSysState& message) noexcept;
  void on(Stamp now, const mavlink::CommandAck& message) noexcept;
  void on(Stamp now, const mavlink::ParamValue& message) noexcept;
  void on(Stamp now, const mavlink::StatusText& message) noexcept;
  /// What is ours to send, not to hear.
  template <typename Other>
  void on(Stamp, const Other&) noexcept {}

  std::optional<Stamp> translate(Stamp now, std::uint64_t stamp_us) noexcept;
  void begin_anew() noexcept;
  void request_messages(Stamp now) noexcept;
  void request_parameters(Stamp now) noexcept;
  void pursue(Stamp now) noexcept;
  void command(Stamp now, mavlink::CommandLong wanted) noexcept;
  bool armed() const noexcept;
  bool follows() const noexcept;
  bool wrong_firmware() const noexcept;

  MavlinkConfig config_;
  Outlet* outlet_;
  TimeSync time_sync_;
  Odometer odometer_;
  CommandDesk desk_;
  Parameters parameters_;

  std::optional<mavlink::Address> peer_;
  mavlink::Heartbeat heartbeat_;
  std::optional<Stamp> heartbeat_sent_;
  Stamp heard_{0};
  std::uint64_t clock_restarts_ = 0;
  std::optional<std::int64_t> unix_less_boot_us_;
  std::size_t next_message_ = 0;  // of those to ask for

  Pursuit pursuit_;

  template <typename Value>
  struct Heard {
    Stamp at{0};
    Value value;
  };
  std::optional<Heard<flight::PilotSwitches>> pilot_;
  std::optional<Heard<double>> force_z_;
  std::optional<Stamp> attitude_at_;
  std::optional<bool> on_ground_;
  std::optional<double> battery_v_;

  NoState no_state_ = NoState::kNotPaired;
  std::uint64_t untranslated_ = 0, refused_setpoints_ = 0, faults_ = 0;
  std::optional<mavlink::Fault> fault_;
  std::optional<mavlink::StatusText> warning_;
};

}  // namespace gatefield::bridge
