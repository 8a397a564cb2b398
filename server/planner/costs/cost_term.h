#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "server/planner/rollout_batch.h"

namespace gatefield::planner {

/// What a term makes of the field; the planner leaves rollouts out of the decoder by it (planner.h).
enum class FieldUse {
  kAny,   ///< whatever: nothing is left out
  kNone,  ///< reads neither `field`, `next_field` nor `crossing_clearance`
  kAdds,  ///< reads them, but of the states only positions, and is never negative
};

/// One term of the cost of a rollout. A term is one file in this folder; how to add one: docs/adding-a-cost-term.md.
/// Thread-safe: accumulate() is const.   Real-time safe: accumulate() must not allocate, lock, log or throw.
class CostTerm {
 public:
  virtual ~CostTerm() = default;
  virtual std::string_view name() const noexcept = 0;
  virtual FieldUse field_use() const noexcept { return FieldUse::kAny; }
  /// cost[m] += this term of rollout m, dimensionless. @pre cost.size() >= batch.stride
  virtual void accumulate(const PlanContext& context, const RolloutBatch& batch,
                          std::span<float> cost) const noexcept = 0;
};

/// The terms that a profile gives weight to, in the order in which they are added up.
std::vector<std::unique_ptr<const CostTerm>> make_terms(const Profile& profile);

}  // namespace gatefield::planner
