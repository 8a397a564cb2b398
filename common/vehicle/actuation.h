#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/base/plain.h"
#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

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

/// What a vehicle of kBodyRates is asked for: collective thrust, N, then body rates about x, y, z of B, rad/s.
using RateCommand = PlainVector4;

/// Holds it where it is: thrust of its weight, no rates.
RateCommand hover_command(const QuadrotorModel& model);

/// One step of a vehicle of kBodyRates, in double precision: the readable reference of server/kernels/rollout/rates.h,
/// and what prediction steps by. What is asked for goes from `begin` to `end` in a straight line during dt (one that
/// holds has both the same). Each of the four, x behind c(t) = c_0 + r t with time constant T, is solved exactly:
///   x(dt) = c_1 - r T + (x_0 - c_0 + r T) e^(-dt/T)
///   mean  = c_0 + r (dt/2 - T) + (x_0 - c_0 + r T) (1 - e^(-dt/T)) T/dt
/// (1) collective thrust and (2) body rates by that; (3) attitude by the exponential map of the mean rates; (4)
/// velocity with the mean thrust times `thrust_factor` along the mid-step attitude and drag at the old velocity; (5)
/// position by the mean of old and new velocity. Torques don't appear: they are the rate loop's affair.
/// @param state  a vehicle of this kind has no rotors that one could know: each of thrust_n and thrust_command_n is a
///               quarter of the collective thrust that is given and asked for
/// Thread-safe: yes.   Real-time safe: yes.
QuadrotorState step_body_rates(const QuadrotorModel& model, const Actuation& actuation, const QuadrotorState& state,
                               const RateCommand& begin, const RateCommand& end, double dt_s,
                               double thrust_factor = 1.0) noexcept;

}  // namespace gatefield
