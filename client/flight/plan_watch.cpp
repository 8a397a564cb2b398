#include "client/flight/plan_watch.h"

#include <cmath>

namespace gatefield::flight {

std::uint64_t PlanWatch::missed(Stamp gap, std::uint64_t plans) const noexcept {
  const auto periods = static_cast<std::uint64_t>(std::lround(seconds(gap) / seconds(period_)));
  return periods > plans ? periods - plans : 0;
}

void PlanWatch::on_plan(std::uint64_t sequence, Stamp arrival) noexcept {
  // A server that restarts counts from 1 again; then nothing is known but that one plan came.
  const std::uint64_t plans = sequence > sequence_ ? sequence - sequence_ : 1;
  if (heard_any_) {
    without_plan_ += missed(arrival - newest_, plans);
  } else {
    first_ = arrival;
  }
  heard_any_ = true;
  newest_ = arrival;
  sequence_ = sequence;
}

PlanWatch::Count PlanWatch::count(Stamp end) const noexcept {
  if (!heard_any_) return {};
  return {static_cast<std::uint64_t>((end - first_) / period_) + 1, without_plan_ + missed(end - newest_, 1)};
}

}  // namespace gatefield::flight
