#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "client/bridge/betaflight/vehicle.h"
#include "client/firmware/betaflight_sitl/exchange.h"
#include "client/simulator/flight_controller_in_loop.h"
#include "common/base/clock.h"
#include "common/base/random.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// What is wrong with the gyro that the firmware is given, rad/s: normal, independent per axis. The firmware calibrates
/// before it is given any, so the bias stays.
struct GyroErrors {
  double noise_rad_s = 0.0;  ///< deviation of each sample, one a millisecond; 0 to 1
  double bias_rad_s = 0.0;   ///< deviation of what is drawn once a flight; 0 to 0.5
};

/// Where the firmware is that flies the vehicle, and how long it is waited for.
struct FirmwareOptions {
  std::string address = "tcp:127.0.0.1:5761";  ///< its MSP; states go to the same host
  std::uint16_t state_port = firmware::betaflight_sitl::kStatePort;
  std::uint16_t motors_port = firmware::betaflight_sitl::kMotorsPort;
  std::uint16_t channels_port = firmware::betaflight_sitl::kChannelsPort;  ///< used from 4.5 on, MSP before
  Stamp arm_limit = std::chrono::seconds(20);            ///< from the first step until it is armed; 1 to 60 s
  Stamp silence_limit = std::chrono::milliseconds(500);  ///< real time: motors this old end the race; 20 ms to 5 s
  GyroErrors gyro;
  Stamp answer_limit = std::chrono::seconds(3);  ///< lockstep: a step that takes longer ends the race; 0.1 to 60 s
};
/// Says which field is wrong and why.
Status validate(const FirmwareOptions& options);

/// Betaflight on a computer in the loop of the simulated vehicle. Each step of the plant the true rates, attitude and
/// specific force go out as its sensors, and its motors come back as what the rotors are asked for:
///
///   T = T_max o^2       o of a motor, 0 to 1; T_max of the vehicle as told
///
/// Setpoints go as any vehicle's do, through the bridge (client/bridge/betaflight), with the firmware's own rates read
/// back and thrust learned in flight. Which wire it speaks follows from the version it tells.
///
/// While the vehicle is held at the start, the firmware is armed: sticks down and the arm switch off until it has no
/// reason against it, then on; then it hovers on the spot. A firmware that does not arm within its time, that brings no
/// motors or no status any more, or that disarms in mid-race, is no longer well().
///
/// In real time it runs by the machine's clock, so the plant must, too. In lockstep, for which it needs the clock
/// library (client/firmware/betaflight_sitl/packets.h), it runs on for the plant's step, and what its motors come to in
/// one step turns the rotors in the next.
/// Thread-safe: no.   Real-time safe: step() in real time (system calls, no allocation); the rest no.
class FirmwareInLoop final : public FlightControllerInLoop, private bridge::betaflight::ChannelSink {
 public:
  /// Finds the firmware and holds its settings against the vehicle.
  /// Errors: those of validate(options) and betaflight::open(); kInvalid for a vehicle that is not driven by body rates
  /// ("actuation"), that has no rotor in one of the four corners ("quadrotor.rotor"), whose rotors turn the other way
  /// than the firmware's mixer has them ("yaw_motors_reversed"), or for a truth of the simulator's own rate loop
  /// ("mismatch").
  static Result<std::unique_ptr<FirmwareInLoop>> open(const FirmwareOptions& options, const config::Scenario& scenario,
                                                      protocol::Timing timing);
  /// Has it disarmed; takes 0.3 s when it was armed.
  ~FirmwareInLoop() override;

  void stand(const QuadrotorState& held) noexcept override;
  bool ready() const noexcept override { return phase_ == Phase::kReady; }
  PlainVector4 step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept override;
  bool well() const noexcept override { return trouble_ == Trouble::kNone; }
  Error failure() const override;
  const std::string& name() const noexcept override { return name_; }

 private:
  enum class Phase : std::uint8_t { kStanding, kArming, kSpinningUp, kReady };
  enum class Trouble : std::uint8_t { kNone, kNotArmed, kSilent, kNoStatus, kDisarmed };
  using Vehicle = bridge::betaflight::BetaflightVehicle;
  using Exchange = firmware::betaflight_sitl::Exchange;
  /// For each rotor of the vehicle the place of its motor.
  using Places = std::array<std::size_t, kRotors>;

  FirmwareInLoop(const FirmwareOptions& options, protocol::Timing timing, const QuadrotorModel& model,
                 const Places& places, std::uint64_t seed, std::unique_ptr<Vehicle> vehicle,
                 std::unique_ptr<Exchange> exchange);
  static Result<Places> places(const QuadrotorModel& model, bool yaw_reversed);
  bool send(const bridge::betaflight::Channels::Pulses& pulses) noexcept override;
  bool lockstep() const noexcept { return timing_ == protocol::Timing::kLockstep; }
  Stamp now() const noexcept;
  Eigen::Vector3d drawn(double deviation) noexcept;
  void hear() noexcept;
  void tell(const QuadrotorState& state, const Eigen::Vector3d& acceleration_W) noexcept;
  bool due(Stamp now) noexcept;
  void arm(Stamp now) noexcept;
  void enter(Phase phase, Stamp now) noexcept;
  void watch(Stamp now) noexcept;

  const FirmwareOptions options_;
  const protocol::Timing timing_;
  const QuadrotorModel model_;
  const Places places_;
  const std::unique_ptr<Vehicle> vehicle_;
  const std::unique_ptr<Exchange> exchange_;
  const std::string name_;
  const sdk::Setpoint hover_;
  Random random_;
  const Eigen::Vector3d gyro_bias_rad_s_;

  Phase phase_ = Phase::kStanding;
  Trouble trouble_ = Trouble::kNone;
  bool begun_ = false, flying_ = false;
  bool answers_ = true;  // lockstep: the last step had its motors
  Stamp time_{0};        // lockstep
  Stamp begin_{0}, phase_since_{0}, next_command_{0};
  Stamp status_stamp_{0}, status_heard_{0};  // of the newest status: now(), and the machine's clock
  QuadrotorState last_;
  firmware::betaflight_sitl::Motors motors_{};
};

}  // namespace gatefield::simulator
