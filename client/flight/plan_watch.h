#pragma once

#include <cstdint>

#include "common/base/clock.h"

namespace gatefield::flight {

/// Counts the control periods that brought no new plan: between two plans that came `gap` apart lie round(gap / period)
/// periods, each of which should have brought one. Plans that came and went unseen while the reader itself was late did
/// come: their sequences tell.
/// Thread-safe: no.   Real-time safe: yes.
class PlanWatch {
 public:
  /// @param period  of the session's control steps, more than zero
  explicit PlanWatch(Stamp period) noexcept : period_(period) {}

  /// @param arrival  when the plan was seen, not falling
  void on_plan(std::uint64_t sequence, Stamp arrival) noexcept;

  bool heard_any() const noexcept { return heard_any_; }
  /// When the newest plan came. @pre heard_any()
  Stamp newest() const noexcept { return newest_; }

  struct Count {
    std::uint64_t periods = 0;       ///< control periods from the first plan to the end, both included; 0: no plan came
    std::uint64_t without_plan = 0;  ///< those of them that brought none
  };
  /// Up to `end`, which is at or after the newest plan.
  Count count(Stamp end) const noexcept;

 private:
  std::uint64_t missed(Stamp gap, std::uint64_t plans) const noexcept;

  Stamp period_;
  Stamp first_{0}, newest_{0};
  std::uint64_t sequence_ = 0;
  std::uint64_t without_plan_ = 0;
  bool heard_any_ = false;
};

}  // namespace gatefield::flight
