#include "server/planner/costs/speed.h"

#include "server/planner/costs/excess.h"

namespace gatefield::planner {

SpeedCost::SpeedCost(const Profile& profile) noexcept : weight_(static_cast<float>(profile.speed_weight)) {}

void SpeedCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                           std::span<float> cost) const noexcept {
  for (int k = 0; k < batch.steps; ++k)
    accumulate_excess(weight_, context.speed_limit_m_s, batch.states.row(k, kernels::kVx),
                      batch.states.row(k, kernels::kVy), batch.states.row(k, kernels::kVz), batch.stride, cost.data());
}

}  // namespace gatefield::planner
