#pragma once

#include <optional>
#include <vector>

#include "client/simulator/flight_controller_in_loop.h"
#include "client/simulator/plant.h"
#include "client/simulator/rate_loop.h"
#include "common/base/result.h"
#include "common/config/scenario.h"
#include "gatefield/sdk/client.h"

namespace gatefield::simulator {

/// What lies between setpoints and rotors, as it truly is: nothing, for a vehicle that takes thrust rates; for one that
/// takes collective thrust and body rates, the way to a flight controller and its rate loop, or a real firmware.
/// Thread-safe: no.   Real-time safe: all but create().
class Drive {
 public:
  /// Of the scenario's vehicle. The flight controller is set up for the vehicle as told: what is mismatched it does not
  /// know either. Its rate loop is tuned to the time constants told, times the scenario's factor. Before the first
  /// setpoint has come all the way, it holds the vehicle: thrust for its weight, no rates.
  /// Errors: a rate loop faster than the rotors (tuned_gains()).
  static Result<Drive> create(const config::Scenario& scenario);
  /// Through a firmware, which outlives this and is ready() before step(). The scenario's factor of thrust acts on what
  /// its motors give.
  static Drive through(FlightControllerInLoop* firmware, const config::Scenario& scenario) noexcept;

  /// Advances the plant by a step under the setpoint.
  void step(const sdk::Setpoint& setpoint, Plant* plant) noexcept;

  /// What the vehicle knows of its true state: thrusts as its commands are reckoned; none of a flight controller's,
  /// nor where the scenario says so.
  QuadrotorState known(const QuadrotorState& truth) const noexcept;
  bool thrust_known() const noexcept { return !hidden_ && !controller_ && firmware_ == nullptr; }

 private:
  struct Asked {
    double collective_n = 0.0;
    Eigen::Vector3d body_rates_rad_s = Eigen::Vector3d::Zero();
  };
  struct Controller {
    RateLoop loop;
    std::vector<Asked> on_the_way;                          ///< one for each step of the delay, and the newest
    std::size_t newest = 0;                                 ///< the one after it, cyclically, is the oldest
    Eigen::Vector3d limit_rad_s = Eigen::Vector3d::Zero();  ///< of what is asked for; 0: none
  };
  Drive(const config::Scenario& scenario, std::optional<Controller> controller)
      : thrust_factor_(scenario.mismatch.thrust_factor),
        hidden_(scenario.hard.thrust_unknown),
        controller_(std::move(controller)) {}

  double thrust_factor_;
  bool hidden_;
  std::optional<Controller> controller_;
  FlightControllerInLoop* firmware_ = nullptr;
};

}  // namespace gatefield::simulator
