#include "client/sdk/problem_watch.h"

namespace gatefield::sdk {

void ProblemWatch::reset() noexcept {
  update(&of_command_, 0);
  update(&of_telemetry_, 0);
}

void ProblemWatch::update(protocol::Problems* of_source, protocol::Problems problems) noexcept {
  const protocol::Problems before = now();
  *of_source = problems;
  const protocol::Problems changed = before ^ now();
  if (changed == 0) return;
  for (int i = 0; i < protocol::kProblems; ++i) {
    const auto problem = static_cast<protocol::Problem>(i);
    if ((changed & bit(problem)) != 0) add({problem, (now() & bit(problem)) != 0});
  }
}

void ProblemWatch::add(const ProblemChange& change) noexcept {
  changes_[(first_ + count_) % kWaiting] = change;
  if (count_ < kWaiting) {
    ++count_;
  } else {
    first_ = (first_ + 1) % kWaiting;
  }
}

std::optional<ProblemChange> ProblemWatch::next() noexcept {
  if (count_ == 0) return std::nullopt;
  const ProblemChange change = changes_[first_];
  first_ = (first_ + 1) % kWaiting;
  --count_;
  return change;
}

}  // namespace gatefield::sdk
