#pragma once

#include <chrono>
#include <vector>

namespace gatefield::service {

/// In the middle of the longest part of a period in which nobody comes due.
/// @param taken   when the others are due, from any moment on, each in [0, period)
/// @param period  > 0
/// @return in (0, period], from that moment on; period when nobody else is there
std::chrono::nanoseconds free_phase(std::vector<std::chrono::nanoseconds> taken, std::chrono::nanoseconds period);

}  // namespace gatefield::service
