#pragma once

#include <Eigen/Core>
#include <span>

#include "common/vehicle/quadrotor.h"

/// Rollouts of the quadrotor under thrust-rate sequences: M samples, K steps, in blocks of samples laid out side by side.
/// Formula: gatefield::step_planner (common/vehicle/quadrotor.h), which is also the double-precision reference.
/// Tolerance against it over 20 steps of 0.03 s: position 1e-3 m, velocity 5e-3 m/s, attitude 1e-3, rates 1e-2 rad/s (fp32).
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
  float* row(int k, int channel) const noexcept { return data + (static_cast<std::ptrdiff_t>(k) * channels + channel) * stride; }
};

/// Rolls out every sample of the block.
/// @param inputs   in: [K][4][M] thrust rates, N/s; out: what was really applied after rate and thrust limits
/// @param states   out: [K][kStateChannels][M], state at the *end* of step k, world frame
/// Thread-safe: yes.   Real-time safe: yes.
void rollout(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs, SampleBlock states) noexcept;

/// Same, one sample after the other through step_planner in double precision.
void rollout_reference(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs,
                       SampleBlock states) noexcept;

}  // namespace gatefield::kernels
