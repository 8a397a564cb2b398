#pragma once

#include <cstdint>
#include <optional>

#include "client/flight/ports.h"

namespace gatefield::flight {

struct StateCheckOptions {
  Stamp lost_after = std::chrono::milliseconds(150);  ///< a state older than this is none; 20 ms to 1 s
  double jump_m = 0.25;                               ///< a place this far from where the velocity led is a jump
  double jump_rad = 0.35;                             ///< the same of the attitude
};

/// Says which field is wrong and why: lost_after 20 ms to 1 s, jumps of 0.02 to 5 m and 0.05 to 3 rad.
Status validate(const StateCheckOptions& options);

/// Which states can be flown by. A state is good when
///   - it is finite, its quaternion of unit length (to 1 %), its stamp at most lost_after old and not ahead of now,
///   - its stamp rises, and
///   - it goes on from the one before: |p - p' - dt (v + v') / 2| <= jump_m, |v - v'| <= 1 m/s + dt 100 m/s^2, and the
///     attitude turned by no more than the body rates allow plus jump_rad (dt up to 0.1 s; later ones begin anew).
/// Each is held against the one before it whether that was good or not: after a jump the second state is good again,
/// and a source that keeps jumping has no good ones.
/// Thread-safe: no.   Real-time safe: yes.
class StateCheck {
 public:
  explicit StateCheck(const StateCheckOptions& options) noexcept : options_(options) {}

  /// The newest state there is, once a step; the same one may come again.
  void take(Stamp now, const TimedState& state) noexcept;
  /// To be called each step, after take().
  void pass(Stamp now) noexcept;

  /// The newest good state, however old; empty: there was none yet.
  const std::optional<TimedState>& newest() const noexcept { return good_; }
  /// There is a good state and it is not too old.
  bool fresh() const noexcept { return fresh_; }
  /// Good states alone for this long, without a gap.
  bool settled(Stamp now, Stamp span) const noexcept {
    return fresh_ && settled_since_ && now - *settled_since_ >= span;
  }
  /// States that were refused.
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  bool good(Stamp now, const TimedState& state) const noexcept;

  StateCheckOptions options_;
  std::optional<TimedState> good_, heard_;
  std::optional<Stamp> settled_since_;
  bool fresh_ = false;
  std::uint64_t refused_ = 0;
};

}  // namespace gatefield::flight
