#pragma once

#include "common/base/clock.h"

namespace gatefield::test {

/// A test's clock, for those who want one of their own. The test's outlives this.
class BorrowedClock final : public Clock {
 public:
  explicit BorrowedClock(const ManualClock& clock) : clock_(clock) {}
  Stamp now() const noexcept override { return clock_.now(); }

 private:
  const ManualClock& clock_;
};

}  // namespace gatefield::test
