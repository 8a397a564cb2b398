#pragma once

#include <Eigen/Core>
#include <optional>

#include "client/flight/ports.h"
#include "client/flight/thrust_estimate.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::bridge {

/// Sends body rates and throttle to an autopilot that has a rate loop: throttle is made of newtons by a ThrustEstimate.
/// Thread-safe: no.   Real-time safe: as send() is.
class RatesActuator : public flight::Actuator {
 public:
  /// @param thrust  outlives this
  RatesActuator(Stamp period, const QuadrotorModel& model, flight::ThrustEstimate* thrust) noexcept
      : period_(period), weight_n_(model.mass_kg * kGravity_m_s2), thrust_(*thrust) {}

  flight::SetpointPart accepts() const noexcept final { return flight::SetpointPart::kCollectiveAndBodyRates; }
  Stamp period() const noexcept final { return period_; }
  void apply(Stamp now, const sdk::Setpoint& setpoint) noexcept final;
  /// On the ground: no thrust and no rates. In the air: what holds the weight, and level rates; that is followed only
  /// where somebody switched to our setpoints before there was a plan.
  void hold(Stamp now) noexcept final;

 protected:
  /// @param body_rates_B  FLU, rad/s   @param throttle  0 to 1
  virtual void send(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept = 0;
  virtual std::optional<flight::ControllerStatus> status(Stamp now) noexcept = 0;
  virtual std::optional<flight::TimedState> state() noexcept = 0;

 private:
  bool in_the_air(Stamp now) noexcept;

  static constexpr double kLifted_m = 0.3;  // off where it was armed, for autopilots that don't say so themselves

  const Stamp period_;
  const double weight_n_;
  flight::ThrustEstimate& thrust_;
  std::optional<double> ground_z_m_;  // where it stood when it was last disarmed
};

}  // namespace gatefield::bridge
