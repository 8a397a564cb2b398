#include "server/service/late_ticks.h"

#include <algorithm>

namespace gatefield::service {

LateTicks::Sum LateTicks::sum(std::chrono::nanoseconds window) const noexcept {
  Sum sum;
  for (const Part& part : parts_) {
    if (parts_.back().when - part.when > window) continue;
    sum.ticks += part.ticks;
    sum.late += part.late;
  }
  return sum;
}

bool LateTicks::beyond(const Limit& limit) const noexcept {
  const Sum found = sum(limit.window);
  return found.late > limit.few && found.share() > limit.part;
}

void LateTicks::add(Stamp now, std::uint64_t ticks, std::uint64_t late) {
  if (!since_) since_ = now;
  parts_.push_back({now, ticks, late});
  while (now - parts_.front().when > kTooMuch.window) parts_.pop_front();
  if (!beyond(kOverload)) {
    overload_since_.reset();
  } else if (!overload_since_) {
    overload_since_ = now;
  }
  if (!closed() && now - not_before_ > kLongestPause) {
    pause_ = kPause;
    share_before_ = 0.0;
  }
}

bool LateTicks::shed_due(Stamp now) const noexcept {
  if (now < not_before_) return false;
  if (overload_since_ && now - *overload_since_ >= kPersists) return true;
  return since_ && now - *since_ >= kTooMuch.window && beyond(kTooMuch);
}

void LateTicks::shed(Stamp now) {
  constexpr double kBroughtNothing = 0.7;
  const double share = std::max(sum(kOverload.window).share(), sum(kTooMuch.window).share());
  const bool in_vain = share_before_ > 0.0 && share > kBroughtNothing * share_before_;
  pause_ = in_vain ? std::min(2 * pause_, kLongestPause) : kPause;
  share_before_ = share;
  not_before_ = now + pause_;
  parts_.clear();
  since_.reset();
  overload_since_.reset();
}

std::string LateTicks::words() const {
  const Sum found = sum(beyond(kHurry) ? kHurry.window : kTooMuch.window);
  return std::to_string(found.late) + " of the last " + std::to_string(found.ticks) + " control ticks were late";
}

}  // namespace gatefield::service
