#pragma once

#include <cstddef>
#include <cstdint>

#include "common/vehicle/quadrotor.h"

/// Rollouts of the quadrotor under thrust-rate sequences: M samples, K steps, in blocks of samples laid out side by
/// side. Formula: gatefield::step_planner (common/vehicle/quadrotor.h), which is also the double-precision reference.
/// Tolerance of single precision against it over 20 steps of 0.03 s:
///   position 1e-3 m, velocity 5e-3 m/s, attitude 1e-3, body rates 1e-2 rad/s
namespace gatefield::kernels {

inline constexpr int kInputs = kRotors;

/// Channels of a rolled-out state that costs look at.
enum StateChannel : int { kPx, kPy, kPz, kVx, kVy, kVz, kQw, kQx, kQy, kQz, kWx, kWy, kWz, kThrustSum, kStateChannels };

/// SoA over samples: element (k, channel, m) lies at data[(k * channels + channel) * stride + m].
/// stride is a multiple of 16 (padding lanes hold finite values). Non-owning.
struct SampleBlock {
  float* data = nullptr;
  int steps = 0;
  int channels = 0;
  int samples = 0;
  int stride = 0;
  float* row(int k, int channel) const noexcept {
    return data + (static_cast<std::ptrdiff_t>(k) * channels + channel) * stride;
  }
};

/// Samples rounded up to whole vectors: kernels read and write that many lanes of every row.
constexpr int padded_samples(int samples) noexcept { return (samples + 15) / 16 * 16; }

/// Beyond these the state saturates, so that no input whatever makes a value that isn't finite; a flyable rollout never
/// gets there. Body rates also stop at kTurnPerStepLimit_rad per step and axis: past that the discretisation means
/// nothing.
inline constexpr double kPositionLimit_m = 1e6;
inline constexpr double kSpeedLimit_m_s = 1e4;
inline constexpr double kRateLimit_rad_s = 1000.0;
inline constexpr double kTurnPerStepLimit_rad = 6.0;
inline constexpr double kThrustLimit_n = 1e4;
double rate_limit_rad_s(double dt_s) noexcept;

/// `start` within those limits: what isn't finite becomes zero, the attitude is normalised (identity when it can't be).
QuadrotorState bounded(const QuadrotorState& start, double dt_s) noexcept;

/// A state that a step led to, within them. @pre finite
QuadrotorState saturated(const QuadrotorState& state, double dt_s) noexcept;
/// Writes it as step k of sample m.
void put_state(const QuadrotorState& state, SampleBlock states, int k, int m) noexcept;

struct RolloutConstants;
/// A block by one instruction set, see simd.cpp.
using RolloutLoop = void(const RolloutConstants&, const SampleBlock& inputs, const SampleBlock& states);
/// For a Highway target that this build has.
RolloutLoop* rollout_loop(std::int64_t target) noexcept;

/// Rolls out every sample of the block (Backend::rollout()).
/// @param inputs   in: [K][4][M] thrust rates, N/s (NaN counts as 0); out: what was really applied after the limits of
///                 thrust and of its rate
/// @param states   out: [K][kStateChannels][M], state at the *end* of step k, world frame
/// @pre model is valid (gatefield::validate), dt_s > 0, both blocks have the same steps, samples and
///      stride >= padded_samples(samples)
/// Thread-safe: yes.   Real-time safe: yes.
void rollout(RolloutLoop* loop, const QuadrotorModel& model, const QuadrotorState& start, double dt_s,
             SampleBlock inputs, SampleBlock states) noexcept;

/// The same, one sample after the other through step_planner in double precision.
void rollout_reference(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs,
                       SampleBlock states) noexcept;

}  // namespace gatefield::kernels
