#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// The frame of the gate that was passed last, which is no target any more and yet in the way: a vehicle that turns
/// sharply behind an opening must not turn into its post, nor back through it where the next gate lies behind.
///   cost += weight (1 + 4 d),   d = min(1, need - clearance)
/// with the least clearance of the rollout's states in the slab that frame and vehicle fill; of states just before the
/// plane, up to the outer edge, it is 0 at most. Nothing where all states are clear. Clearance is taken as
/// inner_half - distance from the axis: round inside the square, so on the safe side in its corners.
class PassedFrameCost final : public CostTerm {
 public:
  explicit PassedFrameCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "passed_frame"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
};

}  // namespace gatefield::planner
