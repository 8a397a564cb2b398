#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "common/base/clock.h"

namespace gatefield {

/// Lets one message through per period and says how many it held back, so that a hostile peer can't fill the disk.
/// Thread-safe: yes.   Real-time safe: yes.
class RateLimiter {
 public:
  explicit RateLimiter(std::chrono::milliseconds period = std::chrono::seconds(1)) : period_(period) {}

  /// True when a message may be written now; `suppressed` then says how many were held back since the last one.
  bool admit(Stamp now, unsigned* suppressed) noexcept {
    auto last = last_.load(std::memory_order_relaxed);
    if (last != kNever && now.count() - last < std::chrono::nanoseconds(period_).count()) {
      held_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    if (!last_.compare_exchange_strong(last, now.count(), std::memory_order_relaxed)) {
      held_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    *suppressed = held_.exchange(0, std::memory_order_relaxed);
    return true;
  }

 private:
  static constexpr std::int64_t kNever = INT64_MIN;
  std::chrono::milliseconds period_;
  std::atomic<std::int64_t> last_{kNever};
  std::atomic<unsigned> held_{0};
};

}  // namespace gatefield
