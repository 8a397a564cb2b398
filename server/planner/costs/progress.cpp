#include "server/planner/costs/progress.h"

#include <algorithm>

#include "common/base/multiversion.h"

namespace gatefield::planner {

ProgressCost::ProgressCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.progress_weight)),
      metric_(profile.progress_metric),
      switch_in_rollout_(profile.switch_in_rollout) {}

namespace progress {

/// As far beyond the plane the way straight on is worth as much as the way to the opening was.
constexpr float kOut_m = 0.5f;

GATEFIELD_MULTIVERSION void squared(const Guidance& target, float start, float weight, const float* x, const float* y,
                                    const float* z, int count, float* cost) noexcept {
  for (int m = 0; m < count; ++m) {
    const float dx = x[m] - target.cx, dy = y[m] - target.cy, dz = z[m] - target.cz;
    cost[m] += weight * (dx * dx + dy * dy + dz * dz - start);
  }
}

GATEFIELD_MULTIVERSION void distance(const Guidance& target_in, const Guidance& next_in, float start,
                                     float next_at_opening, float weight, const float* x, const float* y,
                                     const float* z, const float* through, int count, float* cost) noexcept {
  const Guidance target = target_in, next = next_in;  // local copies: no aliasing with cost
  for (int m = 0; m < count; ++m) {
    const float before = target.potential(x[m], y[m], z[m]);
    const float out = std::clamp(target.along(x[m], y[m], z[m]), 0.0f, kOut_m);
    const float beyond = next.potential(x[m], y[m], z[m]) - next_at_opening - out;
    cost[m] += weight * ((through[m] > 0.5f ? beyond : before) - start);
  }
}

}  // namespace progress

void ProgressCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                              std::span<float> cost) const noexcept {
  const int last = batch.steps - 1;
  const float* x = batch.states.row(last, kernels::kPx);
  const float* y = batch.states.row(last, kernels::kPy);
  const float* z = batch.states.row(last, kernels::kPz);
  const Guidance& target = context.target;
  const Eigen::Vector3f& p0 = context.start_p_WB;
  if (metric_ == ProgressMetric::kSquaredDistance) {
    const float start = (p0 - Eigen::Vector3f(target.cx, target.cy, target.cz)).squaredNorm();
    progress::squared(target, start, weight_, x, y, z, batch.stride, cost.data());
    return;
  }
  const float start = target.potential(p0.x(), p0.y(), p0.z());
  if (switch_in_rollout_ && context.has_next) {
    const float from_m = context.next_from_m;
    const float next_at_opening = context.next.potential(target.cx + from_m * target.ax, target.cy + from_m * target.ay,
                                                         target.cz + from_m * target.az);
    progress::distance(target, context.next, start, next_at_opening, weight_, x, y, z, batch.through_row(last),
                       batch.stride, cost.data());
    return;
  }
  // The last gate: beyond it, straight on counts as progress, or the vehicle would brake in the opening.
  Guidance straight;
  straight.cx = target.cx + kStraightOn_m * target.ax;
  straight.cy = target.cy + kStraightOn_m * target.ay;
  straight.cz = target.cz + kStraightOn_m * target.az;
  if (!switch_in_rollout_ || context.hold) {
    for (int m = 0; m < batch.stride; ++m)
      cost[static_cast<std::size_t>(m)] += weight_ * (target.potential(x[m], y[m], z[m]) - start);
    return;
  }
  progress::distance(target, straight, start, kStraightOn_m, weight_, x, y, z, batch.through_row(last), batch.stride,
                     cost.data());
}

}  // namespace gatefield::planner
