#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "client/simulator/flight_controller_in_loop.h"
#include "client/simulator/px4_bridge.h"
#include "client/simulator/px4_exchange.h"
#include "client/simulator/px4_options.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// PX4 in the loop of the simulated vehicle: its SITL in lockstep, or a board by its own clock (Px4Exchange). It is
/// shown sensors with noise and bias, and its motors give
///
///   T = T_max o^2       o of a motor, 0 to 1; T_max of the vehicle as told
///
/// with PX4's motors 1 to 4 front right, rear left, front left, rear right, as its quadrotors in X have them.
///
/// While the vehicle is held, PX4 boots, finds its attitude, is armed and hovers. Then it is asked for a turn about
/// each axis, and its motors are held against the vehicle's layout: a mixer that is set up for another vehicle is told
/// before it flies (CA_ROTOR0_KM and the like).
///
/// The race ends when motors do not come in time, when PX4 disarms, or leaves our setpoints.
/// Thread-safe: no.   Real-time safe: no in lockstep (it waits for PX4); with a board stand() and step() are (system
/// calls; allocation for what ends the race).
class Px4InLoop final : public FlightControllerInLoop {
 public:
  /// Waits for PX4 to connect and to boot, and for its bridge.
  /// Errors: those of validate(options), check_firmware_scenario(), corners(), Px4Exchange and the bridge.
  static Result<std::unique_ptr<Px4InLoop>> open(const Px4Options& options, const config::Scenario& scenario);
  /// Has the motors stopped.
  ~Px4InLoop() override;

  void stand(const QuadrotorState& held) noexcept override;
  bool ready() const noexcept override { return phase_ == Phase::kReady; }
  PlainVector4 step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept override;
  bool well() const noexcept override { return trouble_ == Trouble::kNone; }
  Error failure() const override;
  const std::string& name() const noexcept override { return bridge_.name; }

 private:
  enum class Phase : std::uint8_t { kStanding, kArming, kSpinningUp, kSteady, kTurning, kReady };
  enum class Trouble : std::uint8_t { kNone, kLink, kNotArmed, kMixer, kNoStatus, kDisarmed, kNotFollowing };
  using Places = std::array<std::size_t, kRotors>;  // of each rotor's motor
  static constexpr std::size_t kAxes = 3;

  Px4InLoop(const Px4Options& options, const config::Scenario& scenario, const Places& places,
            std::unique_ptr<Px4Exchange> exchange);
  Status connect(const QuadrotorState& held);
  Stamp now() const noexcept { return exchange_->clock().now(); }
  void advance(const QuadrotorState& state) noexcept;
  bool due(Stamp now) noexcept;
  void arm(Stamp now) noexcept;
  void turn(Stamp now) noexcept;
  bool lasted(Stamp now, Stamp span) const noexcept;
  void enter(Phase phase, Stamp now) noexcept;
  void watch(Stamp now) noexcept;
  PlainVector4 thrust_n() const noexcept;
  Eigen::Vector3d turning() const noexcept;

  const Px4Options options_;
  const QuadrotorModel model_;
  const Places places_;
  const sdk::Setpoint hover_;
  const std::unique_ptr<Px4Exchange> exchange_;
  Px4Bridge bridge_;

  Phase phase_ = Phase::kStanding;
  Trouble trouble_ = Trouble::kNone;
  bool begun_ = false, flying_ = false;
  Stamp begin_{0}, phase_since_{0}, next_command_{0};
  std::size_t axis_ = 0;
  int asked_ = 0;              // setpoints since the phase began
  std::uint64_t answers_ = 0;  // of motors when it did
  Eigen::Vector3d before_turn_ = Eigen::Vector3d::Zero();
  QuadrotorState last_;
};

}  // namespace gatefield::simulator
