#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "client/bridge/betaflight/settings.h"
#include "client/bridge/betaflight/stick_curve.h"
#include "client/bridge/betaflight/throttle_curve.h"

namespace gatefield::bridge::betaflight {

/// Makes channels of what is wanted, in the order in which the firmware takes them from its receiver.
///
/// Betaflight's body axes are FLU, and its sticks ask for rates about them: roll to the right is +x, pitch forward (a
/// longer pulse) is nose down, +y, and yaw to the right (a longer pulse) is -z.
/// Thread-safe: yes (const).   Real-time safe: yes.
class Channels {
 public:
  Channels(const Settings& settings, const Options& options) noexcept;

  using Pulses = std::array<std::uint16_t, msp::kMaxChannels>;  ///< microseconds

  /// @param body_rates_rad_s  FLU; what is not finite is taken as 0
  /// @param throttle  0 to 1, as the mixer is to have it
  Pulses flying(const Eigen::Vector3d& body_rates_rad_s, double throttle, bool armed) const noexcept;
  /// Sticks in the middle, throttle pulled down: how a vehicle stands on the ground, and what arms.
  Pulses standing(bool armed) const noexcept;

  /// What the firmware will make of these pulses.
  struct Understood {
    Eigen::Vector3d body_rates_rad_s;
    double throttle;
  };
  Understood understood(const Pulses& pulses) const noexcept;

 private:
  Pulses in_order(const std::array<int, 4>& sticks_us, bool armed) const noexcept;

  std::array<StickCurve, 3> sticks_;
  ThrottleCurve throttle_;
  msp::RxMap map_;
  int middle_us_, arm_place_, arm_us_;
  int yaw_sign_;
};

}  // namespace gatefield::bridge::betaflight
