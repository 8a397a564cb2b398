#include "server/planner/costs/altitude.h"

#include <algorithm>

namespace gatefield::planner {

AltitudeCost::AltitudeCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.altitude_weight)),
      min_m_(static_cast<float>(profile.altitude_min_m)),
      max_m_(static_cast<float>(profile.altitude_max_m)) {}

void AltitudeCost::accumulate(const PlanContext&, const RolloutBatch& batch, std::span<float> cost) const noexcept {
  for (int k = 0; k < batch.steps; ++k) {
    const float* z = batch.states.row(k, kernels::kPz);
    for (int m = 0; m < batch.stride; ++m)
      cost[static_cast<std::size_t>(m)] += weight_ * (std::max(0.0f, min_m_ - z[m]) + std::max(0.0f, z[m] - max_m_));
  }
}

}  // namespace gatefield::planner
