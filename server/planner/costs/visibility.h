#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Perception alignment (paper, Eq. "visibility_cost"): weight sum_k (1 - cos(psi_k - psi_gate,k)), the angle between
/// the body's x axis and the line of sight to the gate, both seen from above. Nearer than look_ahead to the opening
/// (times gates::gate_size(): where its frame leaves the image), the next gate is looked at.
class VisibilityCost final : public CostTerm {
 public:
  explicit VisibilityCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "visibility"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
  float look_ahead_m_;
};

}  // namespace gatefield::planner
