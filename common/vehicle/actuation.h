#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/base/result.h"

namespace gatefield {

/// How a vehicle is driven: what it does with a command. Rollouts and prediction need its lags.
struct Actuation {
  enum class Kind : std::uint8_t {
    kRotorThrusts = 0,  ///< each rotor's thrust follows its command with the rotors' lag (QuadrotorModel)
    kBodyRates = 1,     ///< a flight controller follows collective thrust and body rates
  };
  Kind kind = Kind::kRotorThrusts;
  double thrust_time_constant_s = 0.0;  ///< kBodyRates: first-order lag of the collective thrust; else 0
  /// kBodyRates: first-order lag of each body rate behind its command, about x, y, z of B; else 0.
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> rate_time_constant_s = Eigen::Vector3d::Zero();
};

/// Says which field is wrong and why: lags 0.001 to 1 s for kBodyRates, all 0 for kRotorThrusts.
Status validate(const Actuation& actuation);

}  // namespace gatefield
