#include "client/bridge/betaflight/channels.h"

#include <algorithm>

namespace gatefield::bridge::betaflight {
namespace {

constexpr int kThrottle = 3, kFirstAux = 4;

}  // namespace

Channels::Channels(const Settings& settings, const Options& options) noexcept
    : sticks_{StickCurve(settings.tuning.type, settings.tuning.axes[0], settings.deadband.roll_pitch),
              StickCurve(settings.tuning.type, settings.tuning.axes[1], settings.deadband.roll_pitch),
              StickCurve(settings.tuning.type, settings.tuning.axes[2], settings.deadband.yaw)},
      throttle_(settings.tuning, settings.rx),
      map_(settings.map),
      middle_us_(settings.rx.mid),
      arm_place_(kFirstAux + options.arm_aux - 1),
      arm_us_(options.arm_us),
      yaw_sign_(options.yaw_reversed ? 1 : -1) {}

Channels::Pulses Channels::flying(const Eigen::Vector3d& body_rates_rad_s, double throttle, bool armed) const noexcept {
  return in_order(
      {middle_us_ + sticks_[0].deflection_us(body_rates_rad_s.x()),
       middle_us_ + sticks_[1].deflection_us(body_rates_rad_s.y()),
       middle_us_ + yaw_sign_ * sticks_[2].deflection_us(body_rates_rad_s.z()), throttle_.pulse_us(throttle)},
      armed);
}

Channels::Pulses Channels::standing(bool armed) const noexcept {
  return in_order({middle_us_, middle_us_, middle_us_, ThrottleCurve::kLowest_us}, armed);
}

Channels::Pulses Channels::in_order(const std::array<int, 4>& sticks_us, bool armed) const noexcept {
  Pulses pulses;
  pulses.fill(static_cast<std::uint16_t>(kAuxOff_us));
  const auto place = [&](int channel) {
    return static_cast<std::size_t>(channel < static_cast<int>(map_.size()) ? map_[static_cast<std::size_t>(channel)]
                                                                            : channel);
  };
  for (int i = 0; i < 4; ++i) pulses[place(i)] = static_cast<std::uint16_t>(sticks_us[static_cast<std::size_t>(i)]);
  if (armed) pulses[place(arm_place_)] = static_cast<std::uint16_t>(arm_us_);
  return pulses;
}

Channels::Understood Channels::understood(const Pulses& pulses) const noexcept {
  const auto stick = [&](std::size_t axis) {
    return sticks_[axis].rate_rad_s(
        std::clamp(pulses[map_[axis]] - middle_us_, -StickCurve::kTravel, StickCurve::kTravel));
  };
  return {{stick(0), stick(1), yaw_sign_ * stick(2)},
          throttle_.throttle(
              std::clamp<int>(pulses[map_[kThrottle]], ThrottleCurve::kLowest_us, ThrottleCurve::kHighest_us))};
}

}  // namespace gatefield::bridge::betaflight
