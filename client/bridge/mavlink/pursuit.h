#pragma once

#include <cstdint>
#include <optional>

#include "client/flight/ports.h"

namespace gatefield::bridge {

/// What to ask of an autopilot next, given what is wanted of it (FlightController::want()) and what it says.
///
/// For kArmed the mode that follows setpoints is entered first, then it is armed; before the mode is asked for,
/// setpoints have been sent for kStream. When the autopilot has once done what was wanted and then leaves the mode or
/// disarms, somebody else wants it so (the person, its failsafe): nothing is asked for again before another wish was
/// told.
/// Thread-safe: no.   Real-time safe: yes.   Errors: none.
class Pursuit {
 public:
  static constexpr Stamp kStream{std::chrono::seconds(1)};
  static constexpr Stamp kStreamGap{std::chrono::milliseconds(200)};  ///< a longer one begins the stream anew

  enum class Step : std::uint8_t { kNothing, kEnterMode, kArm, kDisarm, kKill };

  /// @return true: this is another wish than before, and what was asked for is to be forgotten
  bool want(flight::Wanted wanted) noexcept;
  /// A setpoint went out.
  void on_setpoint(Stamp now) noexcept;
  Step next(Stamp now, bool armed, bool follows) noexcept;

  /// It stopped following us while that was wanted.
  bool taken_away() const noexcept { return taken_away_; }

 private:
  flight::Wanted wanted_ = flight::Wanted::kReleased;
  bool reached_ = false, taken_away_ = false;
  std::optional<Stamp> stream_began_;
  Stamp setpoint_sent_{0};
};

}  // namespace gatefield::bridge
