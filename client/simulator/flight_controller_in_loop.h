#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/scenario.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// A real firmware that flies the simulated vehicle: a class for each (firmware_in_loop.h: Betaflight, px4_in_loop.h:
/// PX4). Each step of the plant it is shown what the vehicle's sensors would say, and its motors come back as what the
/// rotors are asked for. Setpoints go to it as any vehicle's do, through its bridge.
///
/// While the vehicle is held at the start, the firmware is armed and brought to hover; from ready() on it flies. A
/// firmware that does not get there in time, and one that stops flying, is no longer well().
/// Thread-safe: no.   Real-time safe: as each class says.
class FlightControllerInLoop {
 public:
  virtual ~FlightControllerInLoop() = default;
  FlightControllerInLoop(const FlightControllerInLoop&) = delete;
  FlightControllerInLoop& operator=(const FlightControllerInLoop&) = delete;

  /// A step of Plant::kStep of a vehicle that is held as it is.
  virtual void stand(const QuadrotorState& held) noexcept = 0;
  /// Armed and hovering; from here on step() may be called.
  virtual bool ready() const noexcept = 0;
  /// A step of Plant::kStep in flight.
  /// @return what each rotor of the vehicle is asked for, N
  virtual PlainVector4 step(const sdk::Setpoint& setpoint, const QuadrotorState& truth) noexcept = 0;

  virtual bool well() const noexcept = 0;
  /// @pre !well()
  virtual Error failure() const = 0;
  /// Link, firmware and version.
  virtual const std::string& name() const noexcept = 0;

 protected:
  FlightControllerInLoop() = default;
};

/// Whether a scenario can be flown through a firmware.
/// Errors: kInvalid for a vehicle that is not driven by body rates ("actuation"), or for a truth of the simulator's own
/// rate loop ("mismatch").
Status check_firmware_scenario(const config::Scenario& scenario);

/// Corners of a vehicle, seen from above.
enum Corner : std::size_t { kRearRight, kFrontRight, kRearLeft, kFrontLeft };
/// In which corner each rotor of the vehicle is.
/// Errors: kInvalid ("quadrotor.rotor") when there is not one rotor in each.
Result<std::array<Corner, kRotors>> corners(const QuadrotorModel& model);

/// A firmware stopped flying: kNotAnswering ("flight_controller"), with what it says of itself behind what happened.
Error firmware_lost(const std::string& name, const std::string& what, const std::vector<std::string>& complaints);

/// Thrust of the weight, and no rates.
sdk::Setpoint hover_setpoint(const QuadrotorModel& model) noexcept;

/// What an accelerometer without errors feels, m/s2.
Eigen::Vector3d specific_force_B(const QuadrotorState& state, const Eigen::Vector3d& acceleration_W) noexcept;

}  // namespace gatefield::simulator
