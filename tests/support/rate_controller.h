#pragma once

#include <Eigen/Core>
#include <array>

#include "common/base/clock.h"

/// A small flight controller of our own, as tests fly it behind the protocols of the real ones: rate loop, mixer,
/// arming and failsafe. It imitates no firmware; it has to fly, to refuse, and to stop.
namespace gatefield::test {

class RateController {
 public:
  struct Options {
    double roll_pitch_gain = 0.08, yaw_gain = 0.2;          ///< motor output per rad/s
    double integral_per_s = 3.0;                            ///< of the gains
    double damping_s = 0.006;                               ///< of the gains, on the measurement
    double filter_s = 0.0015;                               ///< of the gyro
    double idle = 0.04;                                     ///< output of an armed motor
    Stamp failsafe_after = std::chrono::milliseconds(500);  ///< without a setpoint
  };
  explicit RateController(const Options& options) : options_(options) {}

  /// Somebody asks for this; FLU, throttle 0 to 1.
  void command(Stamp now, const Eigen::Vector3d& rates_rad_s, double throttle);
  /// The arm switch. It arms with the throttle down and setpoints coming; off, it disarms at once.
  void arm_switch(Stamp now, bool on);

  /// One step of the loop. @return outputs of the motors, 0 to 1, in the order rear right, front right, rear left,
  /// front left
  std::array<double, 4> step(Stamp now, const Eigen::Vector3d& gyro_rad_s, double dt_s);

  bool armed() const { return armed_; }
  bool in_failsafe() const { return failsafe_; }
  /// No reason not to arm but the switch.
  bool may_arm(Stamp now) const { return !failsafe_ && hears(now) && throttle_ < kLowThrottle; }
  double throttle() const { return throttle_; }
  const Eigen::Vector3d& wanted_rates() const { return rates_; }

 private:
  static constexpr double kLowThrottle = 0.01;
  bool hears(Stamp now) const { return heard_ && now - last_ <= options_.failsafe_after; }

  const Options options_;
  Eigen::Vector3d rates_ = Eigen::Vector3d::Zero();
  double throttle_ = 0.0;
  Stamp last_{0};
  bool heard_ = false, armed_ = false, failsafe_ = false, switch_was_off_ = false;
  Eigen::Vector3d gyro_ = Eigen::Vector3d::Zero(), integral_ = Eigen::Vector3d::Zero();
};

}  // namespace gatefield::test
