#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "common/base/clock.h"
#include "common/vehicle/quadrotor.h"
#include "gatefield/sdk/client.h"

/// What a vehicle gives to the loop (loop.h) and takes from it: a simulated one, a flight controller behind a bridge,
/// hardware in the loop. All stamps are of the loop's clock.
namespace gatefield::flight {

struct Directive;    // supervisor.h
struct Observation;  // arming_checks.h

struct TimedState {
  Stamp stamp{0};  ///< when the state held
  QuadrotorState state;
  bool thrust_known = true;  ///< state.thrust_n is measured or estimated; else the server models it
};

/// Knows the vehicle's state.
class StateSource {
 public:
  virtual ~StateSource() = default;
  /// The newest state there is; empty: none has come yet. The same one may be given again.
  /// Called once a step on the loop's thread: no wait, no allocation.
  virtual std::optional<TimedState> newest(Stamp now) noexcept = 0;
};

/// A frame of the depth camera, row-major, 0 = no return; of the size that the session was joined with.
struct DepthFrame {
  Stamp capture{0};  ///< middle of the exposure
  /// Counts of the camera's metres_per_count, or metres.
  std::variant<std::span<const std::uint16_t>, std::span<const float>> pixels;
};

/// Brings depth frames.
class DepthSource {
 public:
  virtual ~DepthSource() = default;
  /// Waits for a frame that was not given before; of several only the newest counts. Its pixels stay valid until the
  /// next call. Empty: none came in time.
  /// Called on a thread of its own, which may be as slow as it likes; it returns within about `timeout`.
  virtual std::optional<DepthFrame> next(std::chrono::nanoseconds timeout) = 0;
};

/// Which part of a setpoint a vehicle can follow.
enum class SetpointPart : std::uint8_t {
  kRotorThrustRates,        ///< Setpoint::thrust_rate_n_s
  kRotorThrusts,            ///< Setpoint::rotor_thrust_n
  kCollectiveAndBodyRates,  ///< Setpoint::collective_thrust_n, body_rates_rad_s (FLU)
};

/// Moves the vehicle. Called on the loop's thread: no wait, no allocation.
class Actuator {
 public:
  virtual ~Actuator() = default;
  /// What apply() reads of a setpoint. It stays the same, and fits the session's Actuation: collective thrust and body
  /// rates for kBodyRates, one of the two others for kRotorThrusts. A vehicle that takes thrust rates integrates them,
  /// and its states say the thrusts it has come to; for one that takes thrusts the loop fills in state.thrust_command_n
  /// with those of the setpoint that was applied last; one that takes body rates needs none.
  virtual SetpointPart accepts() const noexcept = 0;
  /// How often apply() or hold() is called: the loop's period. It stays the same.
  virtual Stamp period() const noexcept = 0;
  /// Does this for a period from `now` on.
  virtual void apply(Stamp now, const sdk::Setpoint& setpoint) noexcept = 0;
  /// There is nothing to do: no plan or no state has come yet, or a supervised vehicle stands on the ground or is flown
  /// by somebody else. It stays where it is, by whatever keeps it there (the ground, a hand, its flight controller);
  /// motors that would obey us idle.
  virtual void hold(Stamp now) noexcept = 0;
};

/// What a person's radio says. A switch that the radio does not have is false.
struct PilotSwitches {
  bool arm = false;        ///< the motors may turn
  bool take_over = false;  ///< the person flies by hand
  bool kill = false;       ///< motors off at once, in the air, too
};

/// What the firmware does when our setpoints stop, as its settings were read back.
enum class FirmwareFailsafe : std::uint8_t {
  kNotChecked,  ///< the settings can't be read, or were not yet
  kGood,        ///< it lands, stops the motors or gives the vehicle to the person, within a few seconds
  kBad,         ///< it is off, or goes on with the last setpoint
};

/// What a flight controller says of itself.
struct ControllerStatus {
  Stamp stamp{0};                      ///< when the last word of it was heard; it must keep rising
  bool armed = false;                  ///< the motors turn, or would if a setpoint asked them to
  bool follows_us = false;             ///< our setpoints are what it flies: OFFBOARD, GUIDED, override by MSP
  bool own_failsafe = false;           ///< its own failsafe flies
  std::optional<bool> on_ground;       ///< by its own detector; empty: it has none
  std::optional<PilotSwitches> pilot;  ///< empty: no radio, or it is not heard now
  Stamp pilot_stamp{0};                ///< when the radio said so; 0: as `stamp`
  std::optional<double> battery_v;     ///< the whole pack under load
  /// Accelerometer along z of B (up), gravity not taken off: 9.81 at rest.
  std::optional<double> specific_force_z_m_s2;
  /// Its own attitude, which holds without a position; the heading may count from anywhere.
  std::optional<PlainQuaternion> q_WB;
  FirmwareFailsafe failsafe = FirmwareFailsafe::kNotChecked;
};

/// What is wanted of a flight controller. Only one of them asks for turning motors.
enum class Wanted : std::uint8_t {
  kDisarmed,  ///< on the ground, motors off: disarm it if it is armed. It may refuse in the air. Not told while it is
              ///< armed and nobody asked us (Supervisor::wanted()): that is who armed it's affair.
  kReleased,  ///< somebody else flies (the person, its own failsafe): ask for nothing, take nothing back
  kArmed,     ///< armed, and following us: ask for what is missing. Whose arming is the person's switch alone waits.
  kKilled,    ///< motors off at once, in the air, too
};

/// Arms, disarms and reports. Called on the loop's thread: no wait, no allocation.
class FlightController {
 public:
  virtual ~FlightController() = default;
  /// What it said last; empty: nothing yet. The same may be given again.
  virtual std::optional<ControllerStatus> newest(Stamp now) noexcept = 0;
  /// Told once a step, before apply() or hold(), and again for as long as it is wanted: who implements it decides how
  /// often a request is sent again until the status says that it was followed. Nothing else may arm.
  virtual void want(Stamp now, Wanted wanted) noexcept = 0;
};

/// Watches the loop. Called on the loop's thread: no wait, no allocation.
class Observer {
 public:
  virtual ~Observer() = default;
  /// A plan came that was not heard before.
  virtual void on_plan(const protocol::ThrustRateCommand& plan) noexcept = 0;
  /// Asked at the end of each step. @return false: the flight is over
  virtual bool goes_on() noexcept = 0;
  /// A supervised vehicle has entered another phase.
  virtual void on_phase(const Directive&) noexcept {}
  /// Each step of a supervised vehicle, after on_phase(): what the supervisor says, and what it was told.
  virtual void on_supervised(const Directive&, const Observation&) noexcept {}
};

}  // namespace gatefield::flight
