#pragma once

#include <array>
#include <cstdint>

#include "client/firmware/msp/messages.h"

namespace gatefield::bridge::betaflight {

namespace msp = firmware::msp;

/// What rate Betaflight makes of a stick, turned around: which pulse asks for a rate. With x the deflection beyond the
/// dead band, -1 to 1, and c, s, e the axis' rc_rate, super rate and expo as they are stored (hundredths), its formulas
/// are, in deg/s:
///
///   ACTUAL      10 c x + max(0, 10 s - 10 c) |x| (x^5 e + x (1 - e))
///   BETAFLIGHT  200 c' y / clamp(1 - |x| s, 0.01, 1)      y = x |x|^3 e + x (1 - e), c' = c + 14.54 max(0, c - 2)
///   KISS        200 c k / clamp(1 - |x| s, 0.01, 1)       k = x^3 e + x (1 - e)
///   QUICK       200 c x / clamp(1 - y f, 0.01, 1)         y = |x|^3 e + |x| (1 - e),
///                                                         f = 1 - 200 c / max(1000 s, 200 c)
///   RACEFLIGHT  1000 c z (1 + |x| s)                      z = (1 + e (x^2 - 1)) x
///
/// each limited to the axis' own limit. (Read in src/main/fc/rc.c of 4.4 to 2026.6. QUICK is that of
/// quickrates_rc_expo = OFF, as the firmware comes.) ACTUAL stores degrees a second over 10 in c and s.
///
/// Pulses are whole microseconds, so the inverse is a search in the table of the 501 deflections there are, and what it
/// gives is the nearest rate that can be asked for: within half a step, 1 deg/s at 1000 deg/s of full stick.
/// Thread-safe: yes (const).   Real-time safe: yes.
class StickCurve {
 public:
  static constexpr int kTravel = 500;  ///< microseconds from the middle to the end

  /// @param deadband_us  the axis' dead band, 0 to kTravel / 2
  StickCurve(msp::RcTuning::RatesType type, const msp::RcTuning::Axis& axis, int deadband_us) noexcept;

  /// Microseconds from the middle that ask for this rate, -kTravel to kTravel: the nearest that can be asked for. A
  /// rate that is not finite gives 0.
  int deflection_us(double rate_rad_s) const noexcept;
  /// The rate that the firmware makes of it, |deflection| <= kTravel.
  double rate_rad_s(int deflection_us) const noexcept;
  /// The most that can be asked for.
  double max_rad_s() const noexcept { return rates_rad_s_.back(); }

 private:
  std::array<double, kTravel + 1> rates_rad_s_{};  // by microseconds; not falling
};

}  // namespace gatefield::bridge::betaflight
