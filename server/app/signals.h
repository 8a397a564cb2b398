#pragma once

#include <signal.h>

#include <chrono>

namespace gatefield::app {

/// SIGINT, SIGTERM, SIGHUP and SIGUSR1, taken by the thread that made this alone: all others inherit the mask. SIGPIPE
/// is ignored: whoever reads the log or a page may go away.
/// Thread-safe: no.
class Signals {
 public:
  Signals();
  /// The next one, or 0 when none comes for so long.
  int wait(std::chrono::nanoseconds longest) const;

 private:
  sigset_t set_;
};

}  // namespace gatefield::app
