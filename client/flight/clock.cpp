#include "client/flight/clock.h"

#include <cerrno>
#include <ctime>

namespace gatefield::flight {

Stamp RealTimeClock::sleep_until(Stamp deadline) noexcept {
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(deadline);
  timespec until{};
  until.tv_sec = static_cast<time_t>(whole.count());
  until.tv_nsec = static_cast<long>((deadline - whole).count());
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
  return now();
}

}  // namespace gatefield::flight
