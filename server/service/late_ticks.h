#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/base/clock.h"

namespace gatefield::service {

/// Control ticks of the last seconds that were late, of all vehicles that fly, and what follows: whether newcomers have
/// to wait, and when somebody has to go. Other programs on the same cores make ticks late, too, so this is the last
/// word over what figures promise.
/// Thread-safe: no (housekeeping).
class LateTicks {
 public:
  static constexpr std::chrono::nanoseconds kWindow = std::chrono::seconds(2);
  /// Parts of all ticks; and what may happen to anybody once says nothing.
  static constexpr double kNoNewcomers = 1e-3;
  static constexpr double kOverload = 1e-2;
  static constexpr std::uint64_t kFew = 2;
  /// An overload as old as this costs somebody the seat.
  static constexpr std::chrono::nanoseconds kPersists = std::chrono::milliseconds(1500);
  /// Between two that go: what the first one brought shows only then. Twice as long each time it brought nothing.
  static constexpr std::chrono::nanoseconds kPause = std::chrono::seconds(4);
  static constexpr std::chrono::nanoseconds kLongestPause = std::chrono::seconds(64);

  /// What came since the last call.
  void add(Stamp now, std::uint64_t ticks, std::uint64_t late);

  std::uint64_t ticks() const noexcept { return ticks_; }
  std::uint64_t late() const noexcept { return late_; }
  /// Too many for one more vehicle.
  bool closed() const noexcept { return beyond(kNoNewcomers); }
  /// Somebody has to go now.
  bool shed_due(Stamp now) const noexcept;
  /// Somebody went.
  void shed(Stamp now);

 private:
  struct Part {
    Stamp when;
    std::uint64_t ticks, late;
  };
  double share() const noexcept { return ticks_ > 0 ? static_cast<double>(late_) / static_cast<double>(ticks_) : 0.0; }
  bool beyond(double part) const noexcept { return late_ > kFew && share() > part; }

  std::deque<Part> parts_;
  std::uint64_t ticks_ = 0, late_ = 0;
  std::optional<Stamp> overload_since_;
  Stamp not_before_{0};
  std::chrono::nanoseconds pause_ = kPause;
  double share_before_ = 0.0;  // when the last one went; 0: that was long ago
};

}  // namespace gatefield::service
