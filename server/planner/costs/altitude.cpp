#include "server/planner/costs/altitude.h"

#include <algorithm>

namespace gatefield::planner {

AltitudeCost::AltitudeCost(const Profile& profile) noexcept : weight_(static_cast<float>(profile.altitude_weight)) {}

void AltitudeCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                              std::span<float> cost) const noexcept {
  const float lowest_m = context.lowest_m, highest_m = context.highest_m;
  for (int k = 0; k < batch.steps; ++k) {
    const float* z = batch.states.row(k, kernels::kPz);
    for (int m = 0; m < batch.stride; ++m)
      cost[static_cast<std::size_t>(m)] +=
          weight_ * (std::max(0.0f, lowest_m - z[m]) + std::max(0.0f, z[m] - highest_m));
  }
}

}  // namespace gatefield::planner
