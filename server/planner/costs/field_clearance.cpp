#include "server/planner/costs/field_clearance.h"

#include <algorithm>

#include "common/base/multiversion.h"

namespace gatefield::planner {

FieldClearanceCost::FieldClearanceCost(const Profile& profile) noexcept
    : weight_(static_cast<float>(profile.field_weight)),
      clearance_m_(static_cast<float>(profile.field_clearance_m)),
      switch_in_rollout_(profile.switch_in_rollout) {}

namespace field_clearance {

constexpr float kLowest_m = -2.0f;

/// What there is of a gate's field.
struct Part {
  float use;       ///< 1, or 0 for a field that isn't known: it costs nothing, and any numbers may stand for it
  float per_size;  ///< 1 / gate_size()
};

GATEFIELD_MULTIVERSION void accumulate(float weight, float clearance_m, const float* field, const float* next,
                                       const float* through, const Part& target_in, const Part& next_in, int count,
                                       float* cost) noexcept {
  const Part target = target_in, after = next_in;
  for (int m = 0; m < count; ++m) {
    const float before = target.use * std::max(0.0f, clearance_m - std::max(target.per_size * field[m], kLowest_m));
    const float beyond = after.use * std::max(0.0f, clearance_m - std::max(after.per_size * next[m], kLowest_m));
    cost[m] += weight * (through[m] > 0.5f ? beyond : before);
  }
}

}  // namespace field_clearance

void FieldClearanceCost::accumulate(const PlanContext& context, const RolloutBatch& batch,
                                    std::span<float> cost) const noexcept {
  if (batch.field == nullptr && batch.next_field == nullptr) return;
  for (int k = 0; k < batch.steps; ++k) {
    const float* field = batch.field != nullptr ? batch.field_row(k) : batch.next_field_row(k);
    const bool next_known = switch_in_rollout_ && batch.next_field != nullptr;
    const float* beyond = next_known ? batch.next_field_row(k) : field;
    field_clearance::accumulate(weight_, clearance_m_, field, beyond, batch.through_row(k),
                                {batch.field != nullptr ? 1.0f : 0.0f, 1.0f / context.target_size},
                                {next_known ? 1.0f : 0.0f, 1.0f / context.next_size}, batch.stride, cost.data());
  }
}

}  // namespace gatefield::planner
