#include "server/app/signals.h"

#include <algorithm>
#include <cerrno>

#include "common/base/clock.h"

namespace gatefield::app {

Signals::Signals() {
  signal(SIGPIPE, SIG_IGN);
  sigemptyset(&set_);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGUSR1}) sigaddset(&set_, number);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
}

int Signals::wait(std::chrono::nanoseconds longest) const {
  const MonotonicClock clock;
  for (const Stamp end = clock.now() + longest;;) {
    const Stamp left = std::max(end - clock.now(), Stamp{0});
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(left);
    const timespec span{whole.count(), (left - whole).count()};
    const int number = sigtimedwait(&set_, nullptr, &span);
    if (number > 0) return number;
    if (errno != EINTR) return 0;
  }
}

}  // namespace gatefield::app
