#include "server/planner/costs/passed_frame.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/multiversion.h"

namespace gatefield::planner {

PassedFrameCost::PassedFrameCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.crossing_weight)) {}

namespace passed_frame {

/// No rollout comes back through the plane without a state as near before it as this: a step at 12 m/s.
constexpr float kBack_m = 0.4f;

struct Frame {
  float slab_half_m, inner_half_m, need_m, outside_m;
};

GATEFIELD_MULTIVERSION void deepest(const Guidance& gate_in, const Frame& frame_in, const float* x, const float* y,
                                    const float* z, int count, float* least) noexcept {
  const Guidance gate = gate_in;
  const Frame frame = frame_in;
  for (int m = 0; m < count; ++m) {
    const float dx = x[m] - gate.cx, dy = y[m] - gate.cy, dz = z[m] - gate.cz;
    const float along = dx * gate.ax + dy * gate.ay + dz * gate.az;
    const float lateral = std::sqrt(std::max(0.0f, dx * dx + dy * dy + dz * dz - along * along));
    const float clearance = frame.inner_half_m - lateral;
    const bool near = clearance > frame.outside_m;
    const bool inside = near && std::abs(along) < frame.slab_half_m;
    const bool back = near && along < 0.0f && along > -kBack_m;
    least[m] = std::min(least[m], inside ? clearance : frame.need_m);
    least[m] = std::min(least[m], back ? std::min(clearance, 0.0f) : frame.need_m);
  }
}

}  // namespace passed_frame

void PassedFrameCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                                 std::span<float> cost) const noexcept {
  if (!context.has_passed_gate) return;
  const FrameSize& size = context.passed_frame;
  const passed_frame::Frame frame{size.slab_half_m, size.inner_half_m, context.passed_need_m,
                                  -(size.width_m + context.passed_need_m)};
  constexpr int kChunk = 128;
  std::array<float, kChunk> least;
  for (int first = 0; first < batch.stride; first += kChunk) {
    const int count = std::min(kChunk, batch.stride - first);
    least.fill(frame.need_m);
    for (int k = 0; k < batch.steps; ++k)
      passed_frame::deepest(context.passed_gate, frame, batch.states.row(k, kernels::kPx) + first,
                            batch.states.row(k, kernels::kPy) + first, batch.states.row(k, kernels::kPz) + first, count,
                            least.data());
    for (int i = 0; i < count; ++i) {
      const float lacking = frame.need_m - least[static_cast<std::size_t>(i)];
      if (lacking > 0.0f)
        cost[static_cast<std::size_t>(first + i)] += weight_ * (1.0f + 4.0f * std::min(1.0f, lacking));
    }
  }
}

}  // namespace gatefield::planner
