#pragma once

#include <string>
#include <vector>

#include "client/flight/clock.h"
#include "client/flight/ports.h"

/// Bridges to flight controllers: each firmware one folder, behind the ports of client/flight.
namespace gatefield::bridge {

/// A vehicle behind a flight controller, as a firmware's folder opens it. Its ports live as long as it does; all are
/// called on the loop's thread.
class Vehicle {
 public:
  virtual ~Vehicle() = default;
  /// Null: the firmware knows no position, and the state comes from elsewhere (motion capture, VIO).
  virtual flight::StateSource* states() noexcept = 0;
  virtual flight::Actuator& actuator() noexcept = 0;
  virtual flight::FlightController& flight_controller() noexcept = 0;
  /// What the loop waits by, where the vehicle has work to do meanwhile; null: any clock.
  virtual flight::LoopClock* clock() noexcept { return nullptr; }

  /// What was found there, a line each: firmware, version, settings that matter.
  virtual std::vector<std::string> description() const = 0;
  /// What stands in the way of a flight and does not keep the bridge from running, a sentence each with the next step:
  /// why it would not arm now, a link that is slow. Not real-time safe.
  virtual std::vector<std::string> complaints() const = 0;
};

}  // namespace gatefield::bridge
