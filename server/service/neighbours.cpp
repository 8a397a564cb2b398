#include "server/service/neighbours.h"

#include <algorithm>
#include <cmath>

namespace gatefield::service {
namespace {

/// Whether it answers before us.
bool comes_before(const protocol::ServerStatus& it, const protocol::ServerStatus& own) {
  if (it.accepts != own.accepts) return it.accepts;
  if (std::abs(it.room_cores - own.room_cores) > Neighbours::kAlike_cores) return it.room_cores > own.room_cores;
  return it.name < own.name;
}

}  // namespace

void Neighbours::hear(const protocol::ParticipantBytes& from, const protocol::ServerStatus& status, Stamp now) {
  const std::lock_guard lock(mutex_);
  if (!neighbours_.contains(from) && neighbours_.size() >= kMost)
    std::erase_if(neighbours_, [&](const auto& one) { return now - one.second.heard > kSilence; });
  if (neighbours_.contains(from) || neighbours_.size() < kMost) neighbours_[from] = {status, now};
}

std::chrono::nanoseconds Neighbours::wait(const protocol::ServerStatus& own, Stamp now) const {
  const std::lock_guard lock(mutex_);
  const auto before = std::count_if(neighbours_.begin(), neighbours_.end(), [&](const auto& one) {
    return now - one.second.heard <= kSilence && comes_before(one.second.status, own);
  });
  return std::min<int>(kMostTurns, static_cast<int>(before)) * kTurn;
}

}  // namespace gatefield::service
