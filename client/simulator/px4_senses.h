#pragma once

#include <cstdint>
#include <optional>

#include "client/firmware/px4_hil/sensors.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// What PX4's sensors say of the simulated vehicle: states in, messages out.
/// Thread-safe: no.   Real-time safe: yes.
class Px4Senses {
 public:
  struct Sample {
    firmware::mavlink::HilSensor sensor;
    std::optional<firmware::mavlink::HilGps> satellites;
    firmware::mavlink::HilStateQuaternion truth;
  };

  /// @pre validate(options)   @param seed  in place of the options'
  Px4Senses(const firmware::SensorOptions& options, std::uint64_t seed) noexcept;

  /// @param now  of the simulation, rising
  Sample take(Stamp now, const QuadrotorState& state) noexcept;
  /// Mean between the two newest samples, m/s2, without errors.
  const Eigen::Vector3d& specific_force_B() const noexcept { return specific_force_B_; }

 private:
  struct Seen {
    Stamp at{0};
    Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
  };
  firmware::Sensors sensors_;
  std::optional<Seen> before_;
  Eigen::Vector3d specific_force_B_{0, 0, kGravity_m_s2};
};

}  // namespace gatefield::simulator
