#pragma once

#include <optional>

#include "common/base/clock.h"

namespace gatefield::flight {

/// For how long something has been so without a break.   Thread-safe: no.   Real-time safe: yes.
class Held {
 public:
  void update(Stamp now, bool holds) noexcept {
    if (!holds)
      since_.reset();
    else if (!since_)
      since_ = now;
  }
  /// True when it has held for `span` by `now`; a span of zero: when it holds.
  bool for_at_least(Stamp now, Stamp span) const noexcept { return since_ && now - *since_ >= span; }

 private:
  std::optional<Stamp> since_;
};

}  // namespace gatefield::flight
