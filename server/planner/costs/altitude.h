#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Keeps off the floor and below the ceiling: weight sum_k (metres outside [lowest, highest]), the heights that the
/// profile permits above the course's reference.
class AltitudeCost final : public CostTerm {
 public:
  explicit AltitudeCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "altitude"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
};

}  // namespace gatefield::planner
