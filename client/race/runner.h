#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/race/flyer.h"
#include "common/base/result.h"

namespace gatefield::race {

struct RunnerOptions {
  int workers = 1;
  int attempts = 3;                       ///< of a trial whose server is lost
  std::chrono::seconds trial_limit{900};  ///< wall clock, for one attempt
  int max_lost_in_a_row = 5;              ///< trials that no worker could fly, one after the other: the run ends
};

/// How a run stands, for a progress line.
struct RunProgress {
  std::size_t done = 0, total = 0;  ///< of this run
  std::size_t won = 0;
  std::size_t lost_attempts = 0;
  double elapsed_s = 0.0;
  double left_s = 0.0;  ///< NaN before the first trial is done
};

struct RunSummary {
  std::size_t flown = 0, won = 0, lost_attempts = 0;
  bool interrupted = false;
  std::string error;       ///< why it ended early; empty: it did not, or a person ended it
  bool no_server = false;  ///< the error is that trials found no server, not that input was bad
};

/// Makes a worker's flyer; called on that worker's thread.
using FlyerFactory = std::function<std::unique_ptr<Flyer>(int worker)>;
/// Takes a result; called on workers' threads, several at once. Errors end the run.
using FlightSink = std::function<Status(const Trial&, const Flight&)>;

/// Flies the trials in order on so many threads and hands each one over as soon as it is flown. A trial that lost its
/// server is tried again, and then handed over as lost (Failure::kLostServer).
/// Supervised from the calling thread: a worker whose server died, that takes too long, or that nobody wants any more
/// is cancelled; every wait has an end.
/// @param stop  becomes true when a person ends the run; trials in flight are dropped
RunSummary run_trials(const std::vector<Trial>& trials, const RunnerOptions& options, const FlyerFactory& factory,
                      const FlightSink& sink, const std::atomic<bool>& stop,
                      const std::function<void(const RunProgress&)>& on_progress = {});

}  // namespace gatefield::race
