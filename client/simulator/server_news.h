#pragma once

#include <vector>

#include "client/simulator/run_log.h"
#include "client/simulator/simulation.h"

namespace gatefield::simulator {

/// What was heard of the server in a race, with the time: the problems that it told of, each once, and what became of
/// the session.
/// Thread-safe: no (one thread at a time).   Real-time safe: no.
class ServerNews {
 public:
  /// @param client, on_problem, on_session  outlive this; the functions may be empty, and are told what comes new
  ServerNews(sdk::Client* client, const ProblemFunction& on_problem, const SessionFunction& on_session)
      : client_(*client), on_problem_(on_problem), on_session_(on_session) {}

  /// Takes what was told since the last call.
  void listen(double race_time_s);

  const std::vector<HeardProblem>& problems() const noexcept { return problems_; }
  const std::vector<HeardSession>& sessions() const noexcept { return sessions_; }

 private:
  sdk::Client& client_;
  const ProblemFunction& on_problem_;
  const SessionFunction& on_session_;
  protocol::Problems known_ = 0;
  std::vector<HeardProblem> problems_;
  std::vector<HeardSession> sessions_;
};

}  // namespace gatefield::simulator
