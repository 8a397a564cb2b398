#pragma once

#include <memory>
#include <span>
#include <vector>

#include "server/planner/costs/cost_term.h"
#include "server/planner/planner.h"
#include "server/planner/rollout_batch.h"

namespace gatefield::planner {

/// What a thread needs for the block it is working on; rows are [K][kBlock].
struct Workspace {
  std::vector<float> states, along, through, clearance, field, next_field;
  std::vector<float> zeros, open;     ///< constant: no rollout is through; a field that is free everywhere
  std::vector<float> crossing, cost;  ///< [kBlock]
  Workspace();
};
/// This thread's; allocated when it is first asked for (Planner::prepare_thread()).
Workspace& workspace();

/// A field that is free everywhere: every forward crossing goes through the opening.
inline constexpr float kOpen_m = 1e4f;

/// What the rollouts of a block cost: the terms of a profile, those that don't need the field apart from the others,
/// and the field itself, asked for where a term wants it.
/// Thread-safe: yes (const).   Real-time safe: all but the constructor.
class RolloutCosts {
 public:
  explicit RolloutCosts(const Profile& profile);

  /// Whether a term has use for fields at all.
  bool want_fields() const noexcept { return want_fields_; }
  /// Whether the terms without field are a lower bound of the whole cost: every other term says FieldUse::kAdds.
  bool bounded_below() const noexcept { return bounded_below_; }

  /// Fills in the rows that follow from positions: fields, `along`, `through`, `crossing_clearance`. The next gate's
  /// field is asked only where a rollout of the block is through the opening. @pre the batch has its positions
  void look_at_fields(const PlanInput& input, const PlanContext& context, Workspace& work,
                      RolloutBatch* batch) const noexcept;
  /// cost[m] = the terms that don't use the field. @pre `along`, `through`
  void weigh_without_field(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept;
  /// cost[m] += the terms that do. @pre all rows
  void add_field(const PlanContext& context, const RolloutBatch& batch, std::span<float> cost) const noexcept;

 private:
  std::vector<std::unique_ptr<const CostTerm>> terms_;  ///< those that don't use the field come first
  std::size_t free_terms_ = 0;                          ///< how many of those there are
  bool want_fields_;
  bool bounded_below_ = true;
};

}  // namespace gatefield::planner
