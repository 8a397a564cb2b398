#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Soft speed limit: weight sum_k max(0, |v_k| - limit)^2, m/s.
class SpeedCost final : public CostTerm {
 public:
  explicit SpeedCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "speed"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
};

}  // namespace gatefield::planner
