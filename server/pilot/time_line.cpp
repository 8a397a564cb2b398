#include "server/pilot/time_line.h"

#include <algorithm>

namespace gatefield::pilot {

bool TimeLine::goes_on(const Point& from, const Point& to, bool free) noexcept {
  if (to.sequence <= from.sequence || to.sequence - from.sequence > kMaxSkip) return false;
  // Stamps may be as far apart as 64 bits allow: compared, never subtracted, until they are known to be near.
  if (to.stamp <= from.stamp) return false;
  const Stamp passed = std::max(to.received - from.received, Stamp{0});
  const Stamp most = free ? kMaxFreeJump : kMaxJump + passed;
  return from.stamp > Stamp::max() - most || to.stamp <= from.stamp + most;
}

TimeLine::Verdict TimeLine::judge(std::uint64_t sequence, Stamp stamp, Stamp received, bool free) noexcept {
  if (stamp > kMaxStamp) return Verdict::kOff;
  const Point here{sequence, stamp, received};
  Point& line = state_.newest;
  if (!state_.begun || goes_on(line, here, free)) {
    state_.begun = true;
    line = here;
    state_.agreeing = 0;
    return Verdict::kNext;
  }
  if (sequence == line.sequence && stamp == line.stamp) return Verdict::kRepeated;
  if (sequence <= line.sequence && stamp <= line.stamp && stamp > line.stamp - kMaxJump) return Verdict::kLate;
  const Point& before = state_.elsewhere;
  const bool insists = free && sequence == before.sequence && stamp == before.stamp;
  const bool agrees = state_.agreeing > 0 && (insists || goes_on(before, here, free));
  state_.agreeing = agrees ? state_.agreeing + 1 : 1;
  state_.elsewhere = here;
  if (state_.agreeing < kAgree) return Verdict::kOff;
  line = here;
  state_.agreeing = 0;
  return Verdict::kNewLine;
}

}  // namespace gatefield::pilot
