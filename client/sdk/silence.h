#pragma once

#include "common/base/clock.h"

namespace gatefield::sdk {

/// Whether the link has fallen silent, by when commands come: no new one for kLeast, nor for twice the longest pause of
/// late, so that a link on which they come in bunches is not taken for one that is cut.
/// Thread-safe: no.   Real-time safe: yes.
class Silence {
 public:
  static constexpr std::chrono::milliseconds kLeast{120};  ///< a stand-by has taken over by then

  void heard(Stamp now) noexcept;
  bool lasts(Stamp now) const noexcept;

 private:
  static constexpr int kForgetting = 4;  // seconds that a second of pause is remembered for

  bool any_ = false;
  Stamp last_{0};
  std::chrono::nanoseconds longest_{0};  // pause of late; fades
};

}  // namespace gatefield::sdk
