#include "server/service/phases.h"

#include <algorithm>

namespace gatefield::service {

std::chrono::nanoseconds free_phase(std::vector<std::chrono::nanoseconds> taken, std::chrono::nanoseconds period) {
  if (taken.empty()) return period;
  std::sort(taken.begin(), taken.end());
  std::chrono::nanoseconds begin = taken.back(), longest = taken.front() + period - begin;
  for (std::size_t i = 1; i < taken.size(); ++i) {
    if (taken[i] - taken[i - 1] <= longest) continue;
    begin = taken[i - 1];
    longest = taken[i] - begin;
  }
  const std::chrono::nanoseconds phase = (begin + longest / 2) % period;
  return phase.count() > 0 ? phase : period;
}

}  // namespace gatefield::service
