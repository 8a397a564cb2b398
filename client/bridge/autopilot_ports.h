#pragma once

#include <Eigen/Core>
#include <optional>

#include "client/bridge/rates_actuator.h"
#include "client/flight/ports.h"
#include "client/flight/thrust_estimate.h"

namespace gatefield::bridge {

/// The loop's ports of a vehicle whose autopilot knows its state: what came is taken up when a state is asked for, and
/// each port then says or asks what its autopilot does.
/// @tparam Vehicle    pump(): takes up what came; now(): the time that its autopilot lives by
/// @tparam Autopilot  state(), status(now), want(now, wanted), send_setpoint(now, body_rates_B, throttle)
/// Thread-safe: no.   Real-time safe: as the vehicle and its autopilot are.
template <typename Vehicle, typename Autopilot>
class AutopilotPorts {
 public:
  /// @param vehicle, autopilot, thrust  outlive this
  AutopilotPorts(Vehicle* vehicle, Autopilot* autopilot, double setpoint_rate_hz, const QuadrotorModel& model,
                 flight::ThrustEstimate* thrust) noexcept
      : states_(vehicle, autopilot),
        actuator_(autopilot, from_seconds(1.0 / setpoint_rate_hz), model, thrust),
        controller_(vehicle, autopilot) {}

  flight::StateSource& states() noexcept { return states_; }
  flight::Actuator& actuator() noexcept { return actuator_; }
  flight::FlightController& flight_controller() noexcept { return controller_; }

 private:
  class States final : public flight::StateSource {
   public:
    States(Vehicle* vehicle, Autopilot* autopilot) noexcept : vehicle_(*vehicle), autopilot_(*autopilot) {}
    std::optional<flight::TimedState> newest(Stamp) noexcept override {
      vehicle_.pump();
      return autopilot_.state();
    }

   private:
    Vehicle& vehicle_;
    Autopilot& autopilot_;
  };

  class Rates final : public RatesActuator {
   public:
    Rates(Autopilot* autopilot, Stamp period, const QuadrotorModel& model, flight::ThrustEstimate* thrust) noexcept
        : RatesActuator(period, model, thrust), autopilot_(*autopilot) {}

   private:
    void send(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept override {
      autopilot_.send_setpoint(now, body_rates_B, throttle);
    }
    std::optional<flight::ControllerStatus> status(Stamp now) noexcept override { return autopilot_.status(now); }
    std::optional<flight::TimedState> state() noexcept override { return autopilot_.state(); }

    Autopilot& autopilot_;
  };

  class Controller final : public flight::FlightController {
   public:
    Controller(Vehicle* vehicle, Autopilot* autopilot) noexcept : vehicle_(*vehicle), autopilot_(*autopilot) {}
    std::optional<flight::ControllerStatus> newest(Stamp) noexcept override {
      return autopilot_.status(vehicle_.now());
    }
    void want(Stamp now, flight::Wanted wanted) noexcept override { autopilot_.want(now, wanted); }

   private:
    Vehicle& vehicle_;
    Autopilot& autopilot_;
  };

  States states_;
  Rates actuator_;
  Controller controller_;
};

}  // namespace gatefield::bridge
