#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Collision with the frame at the crossing of the gate's plane, which the hourglass alone does not know to be solid:
/// weight (1 + 4 d) with d = min(1, need - clearance) where the clearance, from decoder values over the slab that the
/// frame and the vehicle fill, is less than needed. Going back past the frame at its outside is free.
class CrossingCost final : public CostTerm {
 public:
  explicit CrossingCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "crossing"; }
  FieldUse field_use() const noexcept override { return FieldUse::kAdds; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
};

}  // namespace gatefield::planner
