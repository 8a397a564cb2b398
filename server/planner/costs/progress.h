#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Gate progress (paper, Eq. "gate_progress"). The sum over the steps of a difference telescopes, so only the last
/// state counts:
///   squared distance   weight (|p_K - c|^2 - |p_0 - c|^2), as printed
///   distance (ours)    weight (V(p_K) - V(p_0)) with the guidance potential V of the target; for a rollout that is
///                      through the opening, V(p_K) = V_next(p_K) - V_next(c) - min(x, 0.5 m): it goes on earning
///                      progress towards the next gate, and earns some for leaving the opening, x beyond its plane
/// (Behind a gate that is turned far the way to the next one leads backwards, and the last centimetres through the
/// plane earned nothing: the vehicle hovered in the opening.)
class ProgressCost final : public CostTerm {
 public:
  explicit ProgressCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "progress"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  static constexpr float kStraightOn_m = 10.0f;  ///< beyond the last gate
  float weight_;
  ProgressMetric metric_;
  bool switch_in_rollout_;
};

}  // namespace gatefield::planner
