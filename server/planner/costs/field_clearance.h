#pragma once

#include "server/planner/costs/cost_term.h"

namespace gatefield::planner {

/// Gate-SDF guided safety (paper, Eq. "C_sdf"): weight sum_k max(0, d_safe - s_k). Rollouts that have passed the
/// opening are judged by the field of the next gate, or not at all while that has not been seen. s counts in gates of
/// the usual size (metres over gates::gate_size()), so that the middle of an opening is worth the same in any of them.
/// It is bounded below by -2 m, so that a point far from anything the decoder was trained on does not outweigh the
/// rest.
class FieldClearanceCost final : public CostTerm {
 public:
  explicit FieldClearanceCost(const Profile& profile) noexcept;
  std::string_view name() const noexcept override { return "field_clearance"; }
  FieldUse field_use() const noexcept override { return FieldUse::kAdds; }
  void accumulate(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept override;

 private:
  float weight_;
  float clearance_m_;
  bool switch_in_rollout_;
};

}  // namespace gatefield::planner
