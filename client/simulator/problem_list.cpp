#include "client/simulator/problem_list.h"

namespace gatefield::simulator {

void ProblemList::listen(double race_time_s) {
  while (const auto change = client_.problem_change()) {
    if (!change->began || (known_ & bit(change->problem)) != 0) continue;
    known_ |= bit(change->problem);
    heard_.push_back({race_time_s, change->problem});
    if (on_problem_) on_problem_(heard_.back());
  }
}

}  // namespace gatefield::simulator
