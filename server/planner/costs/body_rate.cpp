#include "server/planner/costs/body_rate.h"

#include <algorithm>
#include <cmath>

#include "common/base/multiversion.h"
#include "server/planner/costs/excess.h"

namespace gatefield::planner {

BodyRateCost::BodyRateCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.body_rate_weight)),
      limit_rad_s_(static_cast<float>(profile.body_rate_limit_rad_s)) {}

namespace body_rate {

GATEFIELD_MULTIVERSION void about_axis(float weight, float limit, const float* w, int count, float* cost) noexcept {
  for (int m = 0; m < count; ++m) {
    const float excess = std::max(0.0f, std::abs(w[m]) - limit);
    cost[m] += weight * excess * excess;
  }
}

}  // namespace body_rate

void BodyRateCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                              std::span<float> cost) const noexcept {
  for (int k = 0; k < batch.steps; ++k)
    accumulate_excess(weight_, limit_rad_s_, batch.states.row(k, kernels::kWx), batch.states.row(k, kernels::kWy),
                      batch.states.row(k, kernels::kWz), batch.stride, cost.data());
  for (int axis = 0; axis < 3; ++axis) {
    const float limit_rad_s = context.body_rate_limit_rad_s[axis];
    if (!(limit_rad_s > 0.0f && limit_rad_s < limit_rad_s_)) continue;  // no less than the whole rate's
    for (int k = 0; k < batch.steps; ++k)
      body_rate::about_axis(weight_, limit_rad_s, batch.states.row(k, kernels::kWx + axis), batch.stride, cost.data());
  }
}

}  // namespace gatefield::planner
