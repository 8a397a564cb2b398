#include "server/planner/costs/visibility.h"

#include "common/base/multiversion.h"

namespace gatefield::planner {

VisibilityCost::VisibilityCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.visibility_weight)), look_ahead_m_(static_cast<float>(profile.look_ahead_m)) {}

namespace visibility {

struct Sight {
  float target_x, target_y;
  float next_x, next_y;
  float turn_at_m;  ///< signed distance to the plane from which on the next gate is looked at
};

GATEFIELD_MULTIVERSION void accumulate(const Sight& sight_in, float weight, const float* x, const float* y,
                                       const float* qw, const float* qx, const float* qy, const float* qz,
                                       const float* along, const float* through, int count, float* cost) noexcept {
  const Sight sight = sight_in;
  constexpr float kTiny = 1e-6f;  // straight above the gate or nose straight up, there is no angle: cost 1
  for (int m = 0; m < count; ++m) {
    const bool turn = through[m] > 0.5f || along[m] > sight.turn_at_m;
    const float bx = (turn ? sight.next_x : sight.target_x) - x[m];
    const float by = (turn ? sight.next_y : sight.target_y) - y[m];
    const float hx = 1.0f - 2.0f * (qy[m] * qy[m] + qz[m] * qz[m]);
    const float hy = 2.0f * (qx[m] * qy[m] + qw[m] * qz[m]);
    const float cosine = (bx * hx + by * hy) / std::sqrt((bx * bx + by * by) * (hx * hx + hy * hy) + kTiny);
    cost[m] += weight * (1.0f - cosine);
  }
}

}  // namespace visibility

void VisibilityCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                                std::span<float> cost) const noexcept {
  const Guidance& next = context.has_next ? context.next : context.target;
  const visibility::Sight sight{context.target.cx, context.target.cy, next.cx, next.cy,
                                context.has_next ? -context.target_size * look_ahead_m_ : 1e6f};
  for (int k = 0; k < batch.steps; ++k) {
    const auto row = [&](int channel) { return batch.states.row(k, channel); };
    visibility::accumulate(sight, weight_, row(kernels::kPx), row(kernels::kPy), row(kernels::kQw), row(kernels::kQx),
                           row(kernels::kQy), row(kernels::kQz), batch.along_row(k), batch.through_row(k), batch.stride,
                           cost.data());
  }
}

}  // namespace gatefield::planner
