#include "client/simulator/server_news.h"

#include <utility>

namespace gatefield::simulator {

void ServerNews::listen(double race_time_s) {
  while (const auto change = client_.problem_change()) {
    if (!change->began || (known_ & bit(change->problem)) != 0) continue;
    known_ |= bit(change->problem);
    problems_.push_back({race_time_s, change->problem});
    if (on_problem_) on_problem_(problems_.back());
  }
  while (auto change = client_.session_change()) {
    sessions_.push_back({race_time_s, std::move(*change)});
    if (on_session_) on_session_(sessions_.back());
  }
}

}  // namespace gatefield::simulator
