#pragma once

#include <memory>
#include <string>

#include "client/bridge/vehicle.h"
#include "client/flight/clock.h"
#include "client/flight/thrust_estimate.h"
#include "client/simulator/px4_exchange.h"
#include "client/simulator/px4_options.h"
#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// PX4 as any vehicle's flight controller, through its bridge.
struct Px4Bridge {
  std::unique_ptr<bridge::Vehicle> vehicle;
  flight::ThrustEstimate* thrust = nullptr;  ///< the vehicle's own
  std::string name;                          ///< link, firmware, system
};

/// Waits for PX4 on the way that setpoints go, by its clock. @pre validate(options)   @param exchange  outlives it
/// Errors: those of the bridge's folders.
Result<Px4Bridge> open_px4_bridge(const Px4Options& options, const QuadrotorModel& model, Px4Exchange* exchange);

}  // namespace gatefield::simulator
