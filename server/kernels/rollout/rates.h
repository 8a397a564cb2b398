#pragma once

#include <cstdint>

#include "common/vehicle/actuation.h"
#include "server/kernels/rollout/rollout.h"

/// Rollouts of a vehicle that follows collective thrust and body rates (Actuation::Kind::kBodyRates), laid out as those
/// of rollout.h. Formula: gatefield::step_body_rates (common/vehicle/actuation.h), the double-precision reference.
/// Tolerance of single precision against it over 20 steps of 0.03 s: as in rollout.h.
namespace gatefield::kernels {

/// What the inputs of a sample are.
enum class RateInputs {
  kCommands,  ///< what is asked for, holding for a step
  kChanges,   ///< its change per second, along which it runs from where it was
};

struct RateRollout {
  QuadrotorModel model;  ///< its mass and drag
  Actuation actuation;   ///< its lags
  RateInputs inputs = RateInputs::kCommands;
  double thrust_factor = 1.0;  ///< real thrust over the one that was asked for and followed
  RateCommand low, high;       ///< what may be asked for, both ends in
};

struct RateConstants;
/// A block by one instruction set, see rates_simd.cpp.
using RateLoop = void(const RateConstants&, const SampleBlock& inputs, const SampleBlock& states);
/// For a Highway target that this build has.
RateLoop* rate_loop(std::int64_t target) noexcept;

/// Rolls out every sample of the block (Backend::rollout_rates()).
/// @param start   its thrust_n together are the collective thrust that is given now
/// @param asked   what is asked for when the first step begins
/// @param inputs  in: [K][4][M] collective thrust in N and body rates in rad/s, or their changes per second; one that
///                is no number leaves what was asked for before; out: what was really applied within the limits
/// @param states  out: as rollout() has it; kThrustSum is the collective thrust followed, without the factor
/// @pre validate(actuation), low <= high, dt_s > 0, blocks as rollout() wants them
/// Thread-safe: yes.   Real-time safe: yes.
void rollout_rates(RateLoop* loop, const RateRollout& how, const QuadrotorState& start, const RateCommand& asked,
                   double dt_s, SampleBlock inputs, SampleBlock states) noexcept;

/// The same, one sample after the other through step_body_rates in double precision.
void rollout_rates_reference(const RateRollout& how, const QuadrotorState& start, const RateCommand& asked, double dt_s,
                             SampleBlock inputs, SampleBlock states) noexcept;

/// `asked` within the limits; what isn't finite becomes the middle of them.
RateCommand bounded(const RateRollout& how, const RateCommand& asked) noexcept;

}  // namespace gatefield::kernels
