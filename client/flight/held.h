#pragma once

#include "common/base/clock.h"

namespace gatefield::flight {

/// For how long something has been so without a break.   Thread-safe: no.   Real-time safe: yes.
class Held {
 public:
  void update(Stamp now, bool holds) noexcept {
    if (holds && !holds_) since_ = now;
    holds_ = holds;
  }
  /// True when it has held for `span` by `now`; a span of zero: when it holds.
  bool for_at_least(Stamp now, Stamp span) const noexcept { return holds_ && now - since_ >= span; }

 private:
  bool holds_ = false;
  Stamp since_{0};
};

}  // namespace gatefield::flight
