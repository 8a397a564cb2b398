#include "server/planner/costs/body_rate.h"

#include "server/planner/costs/excess.h"

namespace gatefield::planner {

BodyRateCost::BodyRateCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.body_rate_weight)),
      limit_rad_s_(static_cast<float>(profile.body_rate_limit_rad_s)) {}

void BodyRateCost::accumulate(const PlanContext&, const RolloutBatch& batch, std::span<float> cost) const noexcept {
  for (int k = 0; k < batch.steps; ++k)
    accumulate_excess(weight_, limit_rad_s_, batch.states.row(k, kernels::kWx), batch.states.row(k, kernels::kWy),
                      batch.states.row(k, kernels::kWz), batch.stride, cost.data());
}

}  // namespace gatefield::planner
