#pragma once

#include <array>

#include "client/firmware/msp/messages.h"

namespace gatefield::bridge::betaflight {

namespace msp = firmware::msp;

/// What throttle Betaflight makes of a pulse, turned around: which pulse asks for a throttle, 0 to 1 of the motors'
/// range above idle. The firmware stretches min_check to 2000 microseconds over 0 to 1000 (whole numbers), looks that
/// up in a curve of twelve points, whose middle and bend are throttle mid m and expo e (hundredths) with t = 10 i - m:
///
///   10 m + t (100 - e + e t^2 / y^2) / 10        y = 100 - m above the middle, m below it; whole numbers
///
/// and then scales or clips by the throttle limit. (Read in src/main/fc/rc.c and flight/mixer.c of 4.4 to 2026.6.)
/// Throttle boost, thrust linearisation and the battery's compensation come after it and are not known over MSP: they
/// are to be off (throttle_boost = 0, thrust_linear = 0), or part of what is learned of the thrust.
/// Thread-safe: yes (const).   Real-time safe: yes.
class ThrottleCurve {
 public:
  static constexpr int kLowest_us = 1000, kHighest_us = 2000;

  ThrottleCurve(const msp::RcTuning& tuning, const msp::RxConfig& config) noexcept;

  /// The pulse for this throttle: the nearest that can be asked for, and never below min_check, where the firmware
  /// takes the stick for pulled down. What is not finite gives the lowest.
  int pulse_us(double throttle) const noexcept;
  /// The throttle that the firmware makes of it; kLowest_us <= pulse <= kHighest_us.
  double throttle(int pulse_us) const noexcept;
  double max_throttle() const noexcept { return throttles_.back(); }

 private:
  std::array<double, kHighest_us - kLowest_us + 1> throttles_{};  // not falling
  int lowest_us_;
};

}  // namespace gatefield::bridge::betaflight
