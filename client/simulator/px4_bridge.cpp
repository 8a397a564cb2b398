#include "client/simulator/px4_bridge.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/bridge/mavlink/vehicle.h"
#include "client/bridge/px4/vehicle.h"

namespace gatefield::simulator {
namespace {

using namespace std::chrono_literals;

constexpr Stamp kConnect = 30s;            // until the bridge hears it
constexpr double kStatesBeside_hz = 20.0;  // on a line that its motors need; nobody flies by them

/// The throttle that hovers, and how thrust goes with throttle there: PX4 makes the output o of a throttle u by
///   u = f o^2 + (1 - f) o
/// (its parameter reference, THR_MDL_FAC), and T = T_max o^2.
flight::ThrustOptions thrust_options(const QuadrotorModel& model, double factor) {
  flight::ThrustOptions thrust;
  const double output = std::sqrt(hover_thrust_n(model)[0] / model.thrust_max_n);
  const double throttle = factor * output * output + (1.0 - factor) * output;
  thrust.hover_throttle = std::clamp(throttle, 0.03, 0.9);
  thrust.exponent = std::clamp(2.0 * throttle / (output * (2.0 * factor * output + 1.0 - factor)), 1.0, 2.5);
  return thrust;
}

/// Somebody else's clock for somebody who wants one of his own.
class View final : public flight::LoopClock {
 public:
  explicit View(flight::LoopClock* clock) : clock_(*clock) {}
  Stamp now() const noexcept override { return clock_.now(); }
  Stamp sleep_until(Stamp deadline) noexcept override { return clock_.sleep_until(deadline); }

 private:
  flight::LoopClock& clock_;
};

template <typename Config>
Config common_config(const Px4Options& options, const QuadrotorModel& model) {
  Config config;
  config.arm_by_command = true;
  config.setpoint_rate_hz = kPx4Setpoints_hz;
  config.thrust = thrust_options(model, options.thrust_model_factor);
  config.quadrotor = model;
  config.connect_timeout = kConnect;
  return config;
}

template <typename Concrete>
Px4Bridge joined(std::unique_ptr<Concrete> vehicle) {
  Px4Bridge bridge;
  bridge.thrust = &vehicle->thrust();
  bridge.name = vehicle->description().front();
  bridge.vehicle = std::move(vehicle);
  return bridge;
}

Result<Px4Bridge> over_mavlink(const bridge::MavlinkConfig& config, std::unique_ptr<firmware::Link> link,
                               flight::LoopClock* clock) {
  auto vehicle = std::make_unique<bridge::MavlinkVehicle>(config, std::move(link), std::make_unique<View>(clock));
  if (Status status = vehicle->connect(); !status) return status.failure();
  return joined(std::move(vehicle));
}

class Join {
 public:
  Join(const Px4Options& options, const QuadrotorModel& model, Px4Exchange* exchange)
      : options_(options), model_(model), exchange_(*exchange) {}

  Result<Px4Bridge> operator()(const px4::BusOptions& bus) const {
    auto config = common_config<bridge::Px4Config>(options_, model_);
    config.bus = bus;
    config.stamps = bridge::Stamps::kArrival;
    auto vehicle = bridge::Px4Vehicle::open(config, nullptr, std::make_unique<View>(&exchange_.clock()));
    if (!vehicle) return vehicle.failure();
    return joined(std::move(vehicle).value());
  }

  Result<Px4Bridge> operator()(const std::string& written) const {
    auto config = common_config<bridge::MavlinkConfig>(options_, model_);
    config.link = written;
    auto link = firmware::open(firmware::parse_address(written).value(), config.connect_timeout);
    if (!link) return link.failure();
    return over_mavlink(config, std::move(link).value(), &exchange_.clock());
  }

  Result<Px4Bridge> operator()(const SameLink&) const {
    auto config = common_config<bridge::MavlinkConfig>(options_, model_);
    config.link = options_.hil.address;
    config.state_rate_hz = kStatesBeside_hz;
    config.stamps = bridge::Stamps::kArrival;
    return over_mavlink(config, exchange_.setpoint_link(), &exchange_.clock());
  }

 private:
  const Px4Options& options_;
  const QuadrotorModel& model_;
  Px4Exchange& exchange_;
};

}  // namespace

Result<Px4Bridge> open_px4_bridge(const Px4Options& options, const QuadrotorModel& model, Px4Exchange* exchange) {
  auto bridge = std::visit(Join(options, model, exchange), options.setpoints);
  if (!bridge) return bridge.failure().within("PX4's setpoints: ");
  return bridge;
}

}  // namespace gatefield::simulator
