#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/bridge/betaflight/channels.h"
#include "client/bridge/betaflight/options.h"
#include "client/bridge/betaflight/settings.h"
#include "client/bridge/vehicle.h"
#include "client/firmware/msp/connection.h"
#include "client/flight/thrust_estimate.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::bridge::betaflight {

/// Another way to the firmware's receiver than MSP.
class ChannelSink {
 public:
  virtual ~ChannelSink() = default;
  /// @return false: they were not taken
  virtual bool send(const Channels::Pulses& pulses) noexcept = 0;
};

/// A vehicle behind Betaflight: setpoints become the channels of a radio, the rest is asked for over MSP.
///
/// Each period sends one set of channels and asks one question, in turn: status every second time, attitude and inertia
/// sensors between them, battery and the radio's channels now and then. Every fourth period asks first, so that a
/// flight controller that answers slowly is still heard.
///
/// Until the firmware says that it is armed, the throttle stays down whatever is asked for: it does not arm otherwise.
/// A setpoint that is not finite is flown as standing: sticks in the middle, throttle down. Nothing is sent while
/// Wanted::kReleased, so that the firmware's own failsafe takes over where the bridge is its receiver.
///
/// It knows no position: states() is null.
/// Thread-safe: no.   Real-time safe: the ports, yes (system calls, no allocation).
class BetaflightVehicle final : public Vehicle, public flight::Actuator, public flight::FlightController {
 public:
  /// @pre validate(options), validate(model), and settings that passed check()
  BetaflightVehicle(const Options& options, const QuadrotorModel& model, Settings settings,
                    std::unique_ptr<msp::Connection> connection);

  flight::StateSource* states() noexcept override { return nullptr; }
  flight::Actuator& actuator() noexcept override { return *this; }
  flight::FlightController& flight_controller() noexcept override { return *this; }
  std::vector<std::string> description() const override;
  std::vector<std::string> complaints() const override;

  flight::SetpointPart accepts() const noexcept override { return flight::SetpointPart::kCollectiveAndBodyRates; }
  Stamp period() const noexcept override { return period_; }
  void apply(Stamp now, const sdk::Setpoint& setpoint) noexcept override;
  void hold(Stamp now) noexcept override;

  std::optional<flight::ControllerStatus> newest(Stamp now) noexcept override;
  void want(Stamp, flight::Wanted wanted) noexcept override { wanted_ = wanted; }

  /// Channels go there from now on, not over MSP, which they no longer wait for (Receiver::kUdp).
  /// @param sink  outlives this
  void send_through(ChannelSink* sink, Stamp period) noexcept {
    sink_ = sink;
    period_ = period;
  }
  /// Learns of the thrust in flight; the bridge gives it the states.
  flight::ThrustEstimate& thrust() noexcept { return thrust_; }
  /// What the firmware measured last, FLU; empty: nothing yet.
  const std::optional<msp::RawImu>& imu() const noexcept { return imu_; }
  /// Sets of channels that were not sent because earlier commands were without an answer.
  std::uint64_t channels_skipped() const noexcept { return skipped_; }
  const Settings& settings() const noexcept { return settings_; }

 private:
  void step(Stamp now, const Channels::Pulses& pulses) noexcept;
  bool send_channels(const Channels::Pulses& pulses) noexcept;
  void ask_next() noexcept;
  void hear(Stamp now) noexcept;
  void hear(Stamp now, const msp::Frame& frame) noexcept;
  void on_status(Stamp now, const msp::Status& status) noexcept;
  void learn_gravity(const msp::RawImu& imu) noexcept;
  bool mode(std::uint8_t permanent) const noexcept;
  std::optional<flight::PilotSwitches> pilot_switches() const noexcept;
  bool arm_switch() const noexcept;
  bool arms() const noexcept { return wanted_ == flight::Wanted::kArmed; }

  const Options options_;
  const Settings settings_;
  const Channels channels_;
  Stamp period_;
  const std::size_t channel_count_;
  const std::unique_ptr<msp::Connection> connection_;
  ChannelSink* sink_ = nullptr;
  flight::ThrustEstimate thrust_;
  std::string failsafe_complaint_;
  flight::FirmwareFailsafe failsafe_;

  flight::Wanted wanted_ = flight::Wanted::kDisarmed;
  std::optional<flight::ControllerStatus> status_;
  std::optional<msp::Status> firmware_;
  std::optional<msp::RawImu> imu_;
  std::optional<msp::Channels> radio_;
  Stamp radio_at_{0};
  std::optional<double> counts_per_m_s2_;
  int gravity_samples_ = 0;
  std::uint64_t periods_ = 0, questions_ = 0, skipped_ = 0;
};

/// A flight controller that is there, and how it is set up.
struct Opened {
  std::unique_ptr<msp::Connection> connection;
  Settings settings;
};

/// Opens the link and reads the settings. Errors: those of firmware::open() and read_settings().
Result<Opened> open_connection(const Options& options, const Clock& clock);

/// The same, and checks the settings (check() in settings.h).
/// Errors: those of firmware::open(), read_settings() and check().
Result<std::unique_ptr<BetaflightVehicle>> open(const Options& options, const QuadrotorModel& model,
                                                const Clock& clock);

}  // namespace gatefield::bridge::betaflight
