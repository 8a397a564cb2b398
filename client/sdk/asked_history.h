#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "common/base/clock.h"
#include "common/protocol/asked.h"

namespace gatefield::sdk {

/// What a vehicle was asked for, and from when on: noted by the thread that plays, looked up by who sends states, for
/// the stamps of those, which may lie some time back.
///
/// One writer and one reader share a ring. The reader gives back what lies before the answer to its last question, so
/// states have rising stamps. When none is sent for so long that the ring is full, what is noted meanwhile is lost; the
/// first note after that is kept again.
/// Thread-safe: one thread in note(), one in at().   Real-time safe: yes (no lock, no allocation).
class AskedHistory {
 public:
  /// This holds from `from` on. Stamps rise; one that falls begins a new line.
  void note(Stamp from, const protocol::Asked& asked) noexcept;
  /// What held at `stamp`; before the first note, the plans.
  protocol::Asked at(Stamp stamp) noexcept;

  static constexpr std::uint32_t kCapacity = 1024;  ///< half a second of two notes a millisecond

 private:
  struct Entry {
    Stamp from{0};
    protocol::Asked asked;
  };
  std::array<Entry, kCapacity> ring_;
  alignas(64) std::atomic<std::uint32_t> end_{0};    // the writer's; both count up for ever
  alignas(64) std::atomic<std::uint32_t> begin_{0};  // the reader's

  // The writer's, of its last note.
  bool noted_ = false;
  Stamp noted_from_{0};
  protocol::AskedBy noted_by_ = protocol::AskedBy::kPlans;
};

}  // namespace gatefield::sdk
