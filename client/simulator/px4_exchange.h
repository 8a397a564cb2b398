#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "client/firmware/link/link.h"
#include "client/firmware/px4_hil/hil_motors.h"
#include "client/flight/clock.h"
#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// How PX4 and the simulated vehicle go on together: whose clock it is, how sensors get there and motors back. In
/// lockstep (px4_lockstep.h) or in real time (px4_real_time.h).
/// Thread-safe: no.   Real-time safe: as each class says.
class Px4Exchange {
 public:
  virtual ~Px4Exchange() = default;
  Px4Exchange(const Px4Exchange&) = delete;
  Px4Exchange& operator=(const Px4Exchange&) = delete;

  /// Until PX4 takes sensors.
  virtual Status begin(const QuadrotorState& held) = 0;
  /// Does `join`, which waits for PX4, with a vehicle that is held. Errors: those of `join`; or why PX4 was lost.
  virtual Status meanwhile(const QuadrotorState& held, const std::function<Status()>& join) = 0;

  /// One step, Plant::kStep, of the vehicle, at its end in this state.
  virtual void advance(const QuadrotorState& state) noexcept = 0;
  /// Waits until the next step is due, where advance() doesn't.
  virtual void rest() noexcept = 0;

  /// What PX4 and its bridge live by. Lives as long as this.
  virtual flight::LoopClock& clock() noexcept = 0;
  /// A link for setpoints beside the sensors; null: there is none.
  virtual std::unique_ptr<firmware::Link> setpoint_link() = 0;

  /// The newest; off before the first.
  virtual const firmware::HilMotors& motors() const noexcept = 0;
  /// Of the vehicle, mean between the two newest samples, m/s2.
  virtual const Eigen::Vector3d& specific_force_B() const noexcept = 0;
  /// Why PX4 was lost, for good; empty: it was not.
  virtual const std::optional<Error>& broken() const noexcept = 0;

 protected:
  Px4Exchange() = default;
};

}  // namespace gatefield::simulator
