#pragma once

#include <vector>

#include "client/simulator/run_log.h"
#include "client/simulator/simulation.h"

namespace gatefield::simulator {

/// Which problems the server told of in a race, each once, with the time when it was heard of first.
/// Thread-safe: no (one thread at a time).   Real-time safe: no.
class ProblemList {
 public:
  /// @param client, on_problem  outlive this; on_problem may be empty, and is told what comes new
  ProblemList(sdk::Client* client, const ProblemFunction& on_problem) : client_(*client), on_problem_(on_problem) {}

  /// Takes what was told since the last call.
  void listen(double race_time_s);

  const std::vector<HeardProblem>& heard() const noexcept { return heard_; }

 private:
  sdk::Client& client_;
  const ProblemFunction& on_problem_;
  protocol::Problems known_ = 0;
  std::vector<HeardProblem> heard_;
};

}  // namespace gatefield::simulator
