#pragma once

#include <cstdint>

#include "common/base/random.h"
#include "common/config/scenario.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// What the vehicle believes about itself: what it could know (JudgedVehicle::known()) with an error that is drawn anew
/// each time, normal and independent per axis (attitude: a turn about an axis in the body). Same seed and sequence of
/// calls, same errors.
/// Thread-safe: no.   Real-time safe: yes.
class Estimator {
 public:
  Estimator(const config::StateNoise& noise, std::uint64_t seed) noexcept;

  QuadrotorState estimate(const QuadrotorState& truth) noexcept;

 private:
  Eigen::Vector3d error(double sigma) noexcept;

  config::StateNoise noise_;
  Random random_;
};

}  // namespace gatefield::simulator
