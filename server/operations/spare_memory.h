#pragma once

#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "server/service/figures.h"

namespace gatefield::operations {

/// Gives what the heap keeps free back to the system once nobody flies: sessions of many sizes come and go for weeks,
/// and what they leave between the blocks of others would stay the server's. While somebody flies nothing is given
/// back, since other threads that allocate wait for it (a millisecond or so).
/// From its construction on that is the only time: left to itself the heap would give the top back, and take it again,
/// with every large depth frame. Memory that is locked (--realtime) stays: the kernel gives none of it back.
/// Thread-safe: no.   Real-time safe: no.
class SpareMemory {
 public:
  SpareMemory();
  /// Looks at newer figures, about once a second. @return whether memory was given back now: once after each time that
  /// vehicles were there, when they have been gone for some seconds
  bool look(const service::Figures& figures);

 private:
  std::uint64_t tidy_for_ = 0;  // sessions that had begun when memory was given back last
  std::optional<Stamp> quiet_since_;
};

}  // namespace gatefield::operations
