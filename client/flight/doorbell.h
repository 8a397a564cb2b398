#pragma once

#include <semaphore.h>

#include <cerrno>
#include <chrono>
#include <ctime>

namespace gatefield::flight {

/// Wakes the thread that waits for something in a mailbox: whoever rings never waits, and a ring before the wait is not
/// lost. It carries no data; rings that pile up only wake more often than needed.
/// Thread-safe: yes.   Real-time safe: ring() yes (a system call when somebody waits).
class Doorbell {
 public:
  Doorbell() { sem_init(&semaphore_, 0, 0); }
  ~Doorbell() { sem_destroy(&semaphore_); }
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;

  void ring() noexcept { sem_post(&semaphore_); }

  /// @return true: it was rung; false: the time is over. It is measured by the monotonic clock.
  bool wait_for(std::chrono::nanoseconds timeout) noexcept {
    const auto deadline = std::chrono::steady_clock::now().time_since_epoch() + timeout;
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(deadline);
    timespec until{};
    until.tv_sec = static_cast<time_t>(whole.count());
    until.tv_nsec = static_cast<long>((deadline - whole).count());
    int result = 0;
    while ((result = sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until)) != 0 && errno == EINTR) {
    }
    return result == 0;
  }

 private:
  sem_t semaphore_;
};

}  // namespace gatefield::flight
