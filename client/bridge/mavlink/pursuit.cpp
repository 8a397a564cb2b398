#include "client/bridge/mavlink/pursuit.h"

namespace gatefield::bridge {

using flight::Wanted;

bool Pursuit::want(Wanted wanted) noexcept {
  if (wanted == wanted_) return false;
  reached_ = taken_away_ = false;
  wanted_ = wanted;
  return true;
}

void Pursuit::on_setpoint(Stamp now) noexcept {
  if (!stream_began_ || now - setpoint_sent_ > kStreamGap) stream_began_ = now;
  setpoint_sent_ = now;
}

Pursuit::Step Pursuit::next(Stamp now, bool armed, bool follows) noexcept {
  switch (wanted_) {
    case Wanted::kReleased:
      return Step::kNothing;
    case Wanted::kDisarmed:
      return armed ? Step::kDisarm : Step::kNothing;
    case Wanted::kKilled:
      return armed ? Step::kKill : Step::kNothing;
    case Wanted::kArmed:
      break;
  }
  const bool there = armed && follows;
  taken_away_ = taken_away_ || (reached_ && !there);
  reached_ = reached_ || there;
  const bool streaming = stream_began_ && now - *stream_began_ >= kStream && now - setpoint_sent_ <= kStreamGap;
  if (there || taken_away_ || !streaming) return Step::kNothing;
  return follows ? Step::kArm : Step::kEnterMode;
}

}  // namespace gatefield::bridge
