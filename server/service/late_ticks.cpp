#include "server/service/late_ticks.h"

#include <algorithm>

namespace gatefield::service {

void LateTicks::add(Stamp now, std::uint64_t ticks, std::uint64_t late) {
  parts_.push_back({now, ticks, late});
  ticks_ += ticks;
  late_ += late;
  while (now - parts_.front().when > kWindow) {
    ticks_ -= parts_.front().ticks;
    late_ -= parts_.front().late;
    parts_.pop_front();
  }
  if (!beyond(kOverload)) {
    overload_since_.reset();
    if (now - not_before_ > kLongestPause) {
      pause_ = kPause;
      share_before_ = 0.0;
    }
  } else if (!overload_since_) {
    overload_since_ = now;
  }
}

bool LateTicks::shed_due(Stamp now) const noexcept {
  return overload_since_ && now - *overload_since_ >= kPersists && now >= not_before_;
}

void LateTicks::shed(Stamp now) {
  constexpr double kBroughtNothing = 0.7;
  const bool in_vain = share_before_ > 0.0 && share() > kBroughtNothing * share_before_;
  pause_ = in_vain ? std::min(2 * pause_, kLongestPause) : kPause;
  share_before_ = share();
  not_before_ = now + pause_;
  parts_.clear();
  ticks_ = late_ = 0;
  overload_since_.reset();
}

}  // namespace gatefield::service
