#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "common/base/clock.h"

namespace gatefield::service {

/// Control ticks of the last seconds that were late or narrowly in time, of all vehicles that fly, and what follows:
/// whether newcomers have to wait, and when somebody has to go. Other programs on the same cores make ticks late, too,
/// so this is the last word over what figures promise. Narrow ones warn before any is late: they close the room, and
/// cost nobody the session.
/// Thread-safe: no (housekeeping).
class LateTicks {
 public:
  /// Parts of all ticks, over a short time and a long one; a few may happen to anybody and say nothing.
  struct Limit {
    std::chrono::nanoseconds window;
    double part;
    std::uint64_t few;
  };
  static constexpr Limit kNarrow{std::chrono::seconds(2), 2e-2, 4};    ///< late or narrowly not, beyond: no newcomers
  static constexpr Limit kHurry{std::chrono::seconds(2), 1e-3, 2};     ///< beyond: no newcomers
  static constexpr Limit kOverload{std::chrono::seconds(2), 1e-2, 2};  ///< for kPersists: somebody has to go
  static constexpr Limit kTooMuch{std::chrono::seconds(10), 1e-3, 5};  ///< beyond: neither is it well in the long run
  static constexpr std::chrono::nanoseconds kPersists = std::chrono::milliseconds(1500);
  /// Between two that go: what the first one brought shows only then. Twice as long each time it brought nothing.
  static constexpr std::chrono::nanoseconds kPause = std::chrono::seconds(4);
  static constexpr std::chrono::nanoseconds kLongestPause = std::chrono::seconds(64);

  struct Ticks {
    std::uint64_t all = 0;
    std::uint64_t late = 0;
    std::uint64_t narrow = 0;  ///< in time, after waiting for a thread through more than half of the time they had
  };
  /// What came since the last call.
  void add(Stamp now, const Ticks& ticks);

  /// Too many for one more vehicle.
  bool closed() const noexcept { return beyond(kHurry) || beyond(kTooMuch) || narrow(); }
  /// So many that somebody may have to go.
  bool overloaded() const noexcept { return beyond(kOverload); }
  /// Somebody has to go now.
  bool shed_due(Stamp now) const noexcept;
  /// Somebody went.
  void shed(Stamp now);
  /// "14 of the last 1400 control ticks were late", or "nearly late"
  std::string words() const;

 private:
  struct Part {
    Stamp when;
    Ticks ticks;
  };
  Ticks sum(std::chrono::nanoseconds window) const noexcept;
  bool beyond(const Limit& limit) const noexcept;  ///< late ones
  bool narrow() const noexcept;

  std::deque<Part> parts_;
  std::optional<Stamp> since_;  // the oldest tick that counts
  std::optional<Stamp> overload_since_;
  Stamp not_before_{0};
  std::chrono::nanoseconds pause_ = kPause;
  double share_before_ = 0.0;  // when the last one went; 0: that was long ago
};

}  // namespace gatefield::service
