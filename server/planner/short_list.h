#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/planner/rollout_costs.h"

namespace gatefield::planner {

/// Leaves the field, which is what a step's time goes into, out for rollouts that can no longer get weight.
///
/// Costs that don't need the field come first. They are a lower bound L of the whole cost J, since what the field adds
/// is not negative (FieldUse::kAdds). With J* the least whole cost of a few good rollouts (the scouts: those of least L
/// in each block), a rollout with
///   L > J* + lambda (20 + ln M)
/// has a weight below e^-20 / M of the best one's. All that are left out together have less than e^-20 = 2.1e-9 of the
/// whole weight, and the mean input moves by less than that part of its range: below single precision's rounding. The
/// others, the short list, get the same cost as without all this, bit for bit.
///
/// Whether a rollout passes the opening depends on the field. One that crosses the gate's plane forwards has two
/// bounds, for either answer, and the lesser counts. A block in which a rollout comes back through the plane, for which
/// there are more answers, is weighed whole at once.
///
/// One step: bound() or settle() each block, then scouts(), settle() each of them, choose(), settle() each of those.
/// Thread-safe: bound() and settle() for different blocks and rollouts.   Real-time safe: all but the constructor.
class ShortList {
 public:
  /// @param costs  outlives this. @pre costs->bounded_below()
  ShortList(const Profile& profile, const RolloutCosts* costs);

  /// Keeps a block's positions and what its rollouts cost without the field.
  /// @param batch  with all states
  /// @return false, and nothing is kept: the block has to be weighed whole, and its costs settled
  bool bound(const PlanContext& context, int block, RolloutBatch batch, Workspace& work) noexcept;
  /// The whole costs of a block, from elsewhere. @param cost  [samples of the block]
  void settle(int block, std::span<const float> cost) noexcept;
  /// Whole costs of some bounded rollouts, by asking the field. @pre 0 < rollouts.size() <= kBlock
  void settle(const PlanInput& input, const PlanContext& context, std::span<const int> rollouts) noexcept;

  /// The rollout of least bound of each bounded block. Valid until choose().
  std::span<const int> scouts() noexcept;
  /// Of the rollouts whose cost isn't settled, those that may get weight beside the settled ones. Those that cross the
  /// plane come last: the next gate's field is asked for whole blocks of them.
  std::span<const int> choose(double temperature) noexcept;

  /// [M]: of settled rollouts the whole cost, of those that choose() left out infinity.
  std::span<const float> costs() const noexcept { return {cost_.data(), samples_}; }
  /// How many costs are settled, so for how many rollouts the field was asked.
  int settled() const noexcept;

 private:
  /// What is known of a rollout's cost.
  enum class Known : std::uint8_t {
    kBounded,   ///< `before` when it doesn't pass the opening, else `beyond`, plus what the field adds; doesn't cross
    kCrossing,  ///< the same, and it crosses the plane: both are to be looked at
    kSettled,   ///< `cost` is the whole cost
  };
  /// Least whole cost that a rollout can have. @pre !kSettled
  float bound_of(std::size_t rollout) const noexcept;

  const RolloutCosts* costs_;
  int steps_;
  std::size_t samples_;

  std::vector<Known> known_;  ///< [M], like the next three
  std::vector<float> before_, beyond_, cost_;
  std::vector<float> positions_;  ///< [block][K][3][kBlock]
  std::vector<int> scout_of_;     ///< [block]; -1: weighed whole
  std::vector<int> chosen_;       ///< numbers of rollouts
};

}  // namespace gatefield::planner
