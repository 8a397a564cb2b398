#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "client/bridge/vehicle.h"
#include "client/firmware/px4_hil/hil_link.h"
#include "client/firmware/px4_hil/sensors.h"
#include "client/flight/clock.h"
#include "client/flight/thrust_estimate.h"
#include "client/simulator/flight_controller_in_loop.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "common/dds/px4/layout.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// Where PX4 is, what it is shown, and how setpoints get to it.
struct Px4Options {
  firmware::HilOptions hil;         ///< where it connects to for its sensors; in lockstep
  firmware::SensorOptions sensors;  ///< their errors; the seed is the scenario's
  /// How setpoints get to it: on the bus, through its uXRCE-DDS agent; or over MAVLink, a link of parse_address().
  std::variant<px4::BusOptions, std::string> setpoints = px4::BusOptions();
  /// THR_MDL_FAC as it is set there, 0 to 1: rotors here give T = T_max o^2, so 1 makes thrust of its setpoints linear.
  double thrust_model_factor = 1.0;
  /// Simulated time against the machine's at most, 0.01 to 20: setpoints go to PX4 over links of the real world, and
  /// how old they are there in simulated time grows with it.
  double pace = 1.0;
  Stamp arm_limit = std::chrono::seconds(60);  ///< simulated, from its first motors until it hovers; 1 to 300 s
};
/// Says which field is wrong and why.
Status validate(const Px4Options& options);

/// Time that one thread steps; others read it, and wait for it. Thread-safe: yes.
class SteppedClock final : public flight::LoopClock {
 public:
  Stamp now() const noexcept override { return Stamp(now_.load(std::memory_order_relaxed)); }
  Stamp sleep_until(Stamp deadline) noexcept override;
  void advance(Stamp span) noexcept { now_.fetch_add(span.count(), std::memory_order_relaxed); }

 private:
  std::atomic<std::int64_t> now_{0};
};

/// PX4 in the loop of the simulated vehicle, in lockstep: its clock is the simulation's, and stands still while nobody
/// steps. Every kSample a HIL_SENSOR goes out (and HIL_GPS when one is due), with noise and bias, and its motors are
/// waited for. The truth goes with them, for its log. They give
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
/// Thread-safe: no.   Real-time safe: no (it waits for PX4).
class Px4InLoop final : public FlightControllerInLoop {
 public:
  /// Between two samples, 250 Hz: the rate at which PX4's own simulations run it.
  static constexpr Stamp kSample{std::chrono::milliseconds(4)};

  /// Waits for PX4 to connect and to boot, and for its bridge.
  /// Errors: those of validate(options), check_firmware_scenario(), corners(), HilLink and the bridge.
  static Result<std::unique_ptr<Px4InLoop>> open(const Px4Options& options, const config::Scenario& scenario);
  /// Has the motors stopped.
  ~Px4InLoop() override;

  void stand(const QuadrotorState& held) noexcept override;
  bool ready() const noexcept override { return phase_ == Phase::kReady; }
  PlainVector4 step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept override;
  bool well() const noexcept override { return trouble_ == Trouble::kNone; }
  Error failure() const override;
  const std::string& name() const noexcept override { return name_; }

 private:
  enum class Phase : std::uint8_t { kStanding, kArming, kSpinningUp, kTurning, kReady };
  enum class Trouble : std::uint8_t { kNone, kLink, kNotArmed, kMixer, kNoStatus, kDisarmed, kNotFollowing };
  using Places = std::array<std::size_t, kRotors>;  // of each rotor's motor
  static constexpr std::size_t kAxes = 3;

  Px4InLoop(const Px4Options& options, const config::Scenario& scenario, const Places& places,
            std::unique_ptr<firmware::HilLink> hil);
  Status boot(const QuadrotorState& held);
  Status connect(const QuadrotorState& held);
  Status join(const px4::BusOptions& bus);
  Status join(const std::string& link);
  template <typename Concrete>
  void take(std::unique_ptr<Concrete> vehicle);
  void advance(const QuadrotorState& state) noexcept;
  void keep_pace() noexcept;
  bool due(Stamp now) noexcept;
  void arm(Stamp now) noexcept;
  void turn(Stamp now) noexcept;
  void enter(Phase phase, Stamp now) noexcept;
  void watch(Stamp now) noexcept;
  PlainVector4 thrust_n() const noexcept;
  Eigen::Vector3d turning() const noexcept;

  const Px4Options options_;
  const QuadrotorModel model_;
  const Places places_;
  const sdk::Setpoint hover_;
  SteppedClock clock_;
  const std::unique_ptr<firmware::HilLink> hil_;
  firmware::Sensors sensors_;
  std::unique_ptr<bridge::Vehicle> vehicle_;
  flight::ThrustEstimate* thrust_ = nullptr;
  std::string name_;

  Phase phase_ = Phase::kStanding;
  Trouble trouble_ = Trouble::kNone;
  std::optional<Error> broken_;
  bool begun_ = false, flying_ = false;
  Stamp begin_{0}, phase_since_{0}, next_command_{0}, next_sample_{0};
  std::size_t axis_ = 0;
  Eigen::Vector3d before_turn_ = Eigen::Vector3d::Zero();
  struct Sampled {
    Stamp at{0};
    Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  };
  std::optional<Sampled> sampled_;
  Eigen::Vector3d specific_force_B_{0, 0, kGravity_m_s2};
  QuadrotorState last_;
  firmware::HilMotors motors_;
  Stamp paced_at_{0}, paced_wall_{0};
};

}  // namespace gatefield::simulator
