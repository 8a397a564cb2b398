#include "client/flight/state_check.h"

#include <algorithm>
#include <cmath>

#include "common/base/text.h"

namespace gatefield::flight {
namespace {

constexpr Stamp kAhead = std::chrono::milliseconds(20);  // what clocks that are one may be apart
constexpr double kLongestGap_s = 0.1;
constexpr double kMaxAcceleration_m_s2 = 100.0, kVelocityNoise_m_s = 1.0;

bool sound(const QuadrotorState& state) noexcept {
  return state.p_WB.allFinite() && state.v_WB.allFinite() && state.w_WB_B.allFinite() &&
         state.q_WB.coeffs().allFinite() && std::abs(state.q_WB.norm() - 1.0) <= 0.01;
}

}  // namespace

Status validate(const StateCheckOptions& options) {
  if (options.lost_after < std::chrono::milliseconds(20) || options.lost_after > std::chrono::seconds(1))
    return Error::invalid("lost_after", text(seconds(options.lost_after)) + " s", "0.02 to 1 s");
  if (!(options.jump_m >= 0.02 && options.jump_m <= 5.0))
    return Error::invalid("jump_m", text(options.jump_m) + " m", "0.02 to 5 m");
  if (!(options.jump_rad >= 0.05 && options.jump_rad <= 3.0))
    return Error::invalid("jump_rad", text(options.jump_rad) + " rad", "0.05 to 3 rad");
  return {};
}

bool StateCheck::good(Stamp now, const TimedState& state) const noexcept {
  if (!sound(state.state) || now - state.stamp > options_.lost_after || state.stamp - now > kAhead) return false;
  if (!heard_) return true;
  const double dt_s = seconds(state.stamp - heard_->stamp);
  if (dt_s < 0) return false;
  if (dt_s > kLongestGap_s || !sound(heard_->state)) return true;
  const QuadrotorState &a = heard_->state, &b = state.state;
  const double turned_rad = a.q_WB.normalized().angularDistance(b.q_WB.normalized());
  return (b.p_WB - a.p_WB - dt_s / 2 * (a.v_WB + b.v_WB)).norm() <= options_.jump_m &&
         (b.v_WB - a.v_WB).norm() <= kVelocityNoise_m_s + kMaxAcceleration_m_s2 * dt_s &&
         turned_rad <= options_.jump_rad + dt_s * std::max(a.w_WB_B.norm(), b.w_WB_B.norm());
}

void StateCheck::take(Stamp now, const TimedState& state) noexcept {
  if (heard_ && state.stamp == heard_->stamp) return;
  if (good(now, state)) {
    good_ = state;
    if (!settled_since_) settled_since_ = now;
  } else {
    ++refused_;
    settled_since_.reset();
  }
  heard_ = state;
}

void StateCheck::pass(Stamp now) noexcept {
  fresh_ = good_ && now - good_->stamp <= options_.lost_after;
  if (!fresh_) settled_since_.reset();
}

}  // namespace gatefield::flight
