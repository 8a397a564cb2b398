#pragma once

#include <optional>

#include "client/flight/manoeuvres.h"
#include "client/flight/supervisor.h"
#include "client/flight/thrust_estimate.h"

namespace gatefield::flight {

/// A supervised vehicle's step: the supervisor decides, the manoeuvres say what that means, and the thrust estimate
/// learns while it flies. run_loop() drives it.
/// Thread-safe: no.   Real-time safe: step() yes.
class Supervision {
 public:
  /// @pre validate(options), validate(model), validate(actuation), validate(course)
  /// @param actuation  of the session
  /// @param thrust  what the actuator turns thrust into throttle with; learns here. Null: nothing learns.
  Supervision(const SupervisorOptions& options, const QuadrotorModel& model, const Actuation& actuation,
              const Course& course, ThrustEstimate* thrust = nullptr)
      : supervisor_(options), manoeuvres_(model, actuation, course, options), thrust_(thrust) {}

  /// @param plan  what the plan says for `now`, where observation.plan_valid
  /// @return what to apply; empty: nothing, the vehicle is held
  std::optional<sdk::Setpoint> step(Stamp now, const Observation& observation, const sdk::Setpoint& plan) noexcept;

  const Directive& directive() const noexcept { return supervisor_.directive(); }
  Wanted wanted() const noexcept { return supervisor_.wanted(); }
  /// The air alone carries the vehicle, as far as is known: it is not where it stood when it armed.
  bool off_the_ground() const noexcept;
  const Supervisor& supervisor() const noexcept { return supervisor_; }

 private:
  void learn(const Observation& observation) noexcept;

  Supervisor supervisor_;
  Manoeuvres manoeuvres_;
  ThrustEstimate* thrust_;
};

}  // namespace gatefield::flight
