#include "server/planner/costs/crossing.h"

#include <algorithm>

namespace gatefield::planner {

CrossingCost::CrossingCost(const Profile& profile) noexcept : weight_(static_cast<float>(profile.crossing_weight)) {}

void CrossingCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                              std::span<float> cost) const noexcept {
  for (int m = 0; m < batch.stride; ++m) {
    const float lacking = context.crossing_need_m - batch.crossing_clearance[m];
    if (lacking > 0.0f) cost[static_cast<std::size_t>(m)] += weight_ * (1.0f + 4.0f * std::min(1.0f, lacking));
  }
}

}  // namespace gatefield::planner
