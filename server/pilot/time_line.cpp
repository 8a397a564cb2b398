#include "server/pilot/time_line.h"

#include <algorithm>

namespace gatefield::pilot {
namespace {

/// Lockstep: a simulator may think for as long as it likes between two states, but not leap for a day of its time.
constexpr Stamp kMaxFreeJump = std::chrono::minutes(10);

}  // namespace

bool TimeLine::goes_on(const Point& from, const Point& to, bool free) noexcept {
  if (to.sequence <= from.sequence || to.sequence - from.sequence > kMaxSkip) return false;
  // Stamps may be as far apart as 64 bits allow: compared, never subtracted, until they are known to be near.
  if (to.stamp <= from.stamp) return false;
  const Stamp passed = std::max(to.received - from.received, Stamp{0});
  const Stamp most = free ? kMaxFreeJump : kMaxJump + passed;
  return from.stamp > Stamp::max() - most || to.stamp <= from.stamp + most;
}

TimeLine::Verdict TimeLine::judge(std::uint64_t sequence, Stamp stamp, Stamp received, bool free) noexcept {
  const Point here{sequence, stamp, received};
  if (!begun_ || goes_on(line_, here, free)) {
    begun_ = true;
    line_ = here;
    agreeing_ = 0;
    return Verdict::kNext;
  }
  if (sequence == line_.sequence && stamp == line_.stamp) return Verdict::kRepeated;
  if (sequence <= line_.sequence && stamp <= line_.stamp && stamp > line_.stamp - kMaxJump) return Verdict::kLate;
  agreeing_ = agreeing_ > 0 && goes_on(elsewhere_, here, free) ? agreeing_ + 1 : 1;
  elsewhere_ = here;
  if (agreeing_ < kAgree) return Verdict::kOff;
  line_ = here;
  agreeing_ = 0;
  return Verdict::kNewLine;
}

}  // namespace gatefield::pilot
