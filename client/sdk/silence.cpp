#include "client/sdk/silence.h"

#include <algorithm>

namespace gatefield::sdk {

void Silence::heard(Stamp now) noexcept {
  if (any_ && now > last_) {
    const std::chrono::nanoseconds pause = now - last_;
    longest_ = std::max(pause, longest_ - pause / kForgetting);
  }
  any_ = true;
  last_ = now;
}

bool Silence::lasts(Stamp now) const noexcept {
  return any_ && now - last_ > std::max<std::chrono::nanoseconds>(kLeast, 2 * longest_);
}

}  // namespace gatefield::sdk
