#include "server/service/late_ticks.h"

#include <algorithm>

namespace gatefield::service {
namespace {

double share(std::uint64_t some, std::uint64_t all) {
  return all > 0 ? static_cast<double>(some) / static_cast<double>(all) : 0.0;
}
bool exceeds(const LateTicks::Limit& limit, std::uint64_t some, std::uint64_t all) {
  return some > limit.few && share(some, all) > limit.part;
}

}  // namespace

LateTicks::Ticks LateTicks::sum(std::chrono::nanoseconds window) const noexcept {
  Ticks sum;
  for (const Part& part : parts_) {
    if (parts_.back().when - part.when > window) continue;
    sum.all += part.ticks.all;
    sum.late += part.ticks.late;
    sum.narrow += part.ticks.narrow;
  }
  return sum;
}

bool LateTicks::beyond(const Limit& limit) const noexcept {
  const Ticks found = sum(limit.window);
  return exceeds(limit, found.late, found.all);
}

bool LateTicks::narrow() const noexcept {
  const Ticks found = sum(kNarrow.window);
  return exceeds(kNarrow, found.late + found.narrow, found.all);
}

void LateTicks::add(Stamp now, const Ticks& ticks) {
  if (!since_) since_ = now;
  parts_.push_back({now, ticks});
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
  const Ticks lately = sum(kOverload.window), longer = sum(kTooMuch.window);
  const double late = std::max(share(lately.late, lately.all), share(longer.late, longer.all));
  const bool in_vain = share_before_ > 0.0 && late > kBroughtNothing * share_before_;
  pause_ = in_vain ? std::min(2 * pause_, kLongestPause) : kPause;
  share_before_ = late;
  not_before_ = now + pause_;
  parts_.clear();
  since_.reset();
  overload_since_.reset();
}

std::string LateTicks::words() const {
  const bool late = beyond(kHurry) || beyond(kTooMuch);
  const Ticks found = sum(beyond(kHurry) || !late ? kHurry.window : kTooMuch.window);
  return std::to_string(late ? found.late : found.late + found.narrow) + " of the last " + std::to_string(found.all) +
         (late ? " control ticks were late" : " control ticks were nearly late");
}

}  // namespace gatefield::service
