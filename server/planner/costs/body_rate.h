#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Soft limit on body rates: weight sum_k max(0, |w_k| - limit)^2, rad/s, and the same about each axis where the
/// vehicle has a lower limit of its own. (Clamping them in the model instead made the real vehicle spin.)
class BodyRateCost final : public CostTerm {
 public:
  explicit BodyRateCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "body_rate"; }
  FieldUse field_use() const noexcept override { return FieldUse::kNone; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
  float limit_rad_s_;
};

}  // namespace gatefield::planner
