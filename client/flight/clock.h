#pragma once

#include "common/base/clock.h"

namespace gatefield::flight {

/// A clock that can be waited for; tests put their own in.
class LoopClock : public Clock {
 public:
  /// Returns when `deadline` has come, at once when it has passed. @return the time then, at least `deadline`
  /// Real-time safe: yes (sleeps).
  virtual Stamp sleep_until(Stamp deadline) noexcept = 0;
};

/// The machine's monotonic clock: absolute deadlines, so that lateness does not add up.
class RealTimeClock final : public LoopClock {
 public:
  Stamp now() const noexcept override { return MonotonicClock().now(); }
  Stamp sleep_until(Stamp deadline) noexcept override;
};

}  // namespace gatefield::flight
