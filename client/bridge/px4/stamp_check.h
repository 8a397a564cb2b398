#pragma once

#include <cstdint>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/dds/px4/messages.h"

namespace gatefield::bridge {

/// When a message came: by our clock, and by this machine's wall clock (since 1970), read together.
struct Arrival {
  Stamp now{0};
  Stamp wall{0};
};

struct StampOptions {
  Stamp most_error{std::chrono::milliseconds(20)};  ///< stamps that are off by more are refused; 1 ms to 1 s
};
Status validate(const StampOptions& options);

/// PX4's stamps in our time, and whether they can be believed.
///
/// PX4 translates its stamps into its agent's wall clock, which is this machine's, or one that is held to it (PTP). So
/// a message's age is the wall clock at its arrival less its stamp, and ours = now - age; nothing is lost when the wall
/// clock is set, but what was under way then. Stamps from Micro XRCE-DDS have been seen to be off by 40 ms for minutes
/// after a start, and by half a second, which shows in two ways:
///
///   - The age is the way's delay less the error of the clock, and no delay is below 0. The least age of the last
///     kWindow seconds is near the error, therefore: beyond most_error, or below -kEarly, all stamps are refused.
///   - PX4 tells how it does (TimesyncStatus): the offset of its last question and answer, and the smoothed one that it
///     translates by. Where they differ by more than most_error, kInARow times, it has not settled yet.
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; trouble() says what is wrong.
class StampCheck {
 public:
  static constexpr Stamp kWindow{std::chrono::seconds(1)};
  static constexpr Stamp kEarly{std::chrono::milliseconds(5)};
  static constexpr int kInARow = 3;

  /// @pre validate(options)
  explicit StampCheck(const StampOptions& options) noexcept : options_(options) {}

  /// @return the stamp in our time; empty: it is not believed
  std::optional<Stamp> ours(const Arrival& at, std::uint64_t stamp_us) noexcept;
  void on_timesync(const px4::TimesyncStatus& message) noexcept;

  enum class Trouble : std::uint8_t {
    kNone,
    kSinceBoot,  ///< stamps count from PX4's start: it does not synchronise
    kLate,       ///< the clocks differ, or everything is held up
    kEarly,      ///< stamps lie ahead of now
    kUnsettled,  ///< by its own word
  };
  Trouble trouble() const noexcept;

  /// The least age of the last seconds.
  Stamp least_age() const noexcept;
  /// By its own word: the last offset less the smoothed one, and the round trip; 0 as long as it has said nothing.
  Stamp own_error() const noexcept { return own_error_; }
  Stamp round_trip() const noexcept { return round_trip_; }

 private:
  StampOptions options_;
  bool since_boot_ = false;
  std::optional<Stamp> window_began_;
  Stamp least_{0};                     // of this window
  std::optional<Stamp> least_before_;  // of the window before
  Stamp own_error_{0}, round_trip_{0};
  int unsettled_ = 0;
};

/// The trouble in words, with the figure and the next step. Ok for kNone.
Status describe(StampCheck::Trouble trouble, Stamp least_age, Stamp own_error, const StampOptions& options);

}  // namespace gatefield::bridge
