#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/base/clock.h"
#include "common/vehicle/actuation.h"

namespace gatefield::pilot {

/// How fast a vehicle turns at most, where that is less than it is asked for: a flight controller that clamps the body
/// rates it is sent (Betaflight's rate profile, PX4's MC_*RATE_MAX). Identified from the flight itself, per axis.
///
/// Responses to the commands run beside each other, each from the commands alone, so that no noise of a measurement is
/// fed back:
///   limited   first-order lags behind the command clamped to L, over a grid of L and of lags around the told one
///   others    what a limit must not be taken for: lags behind the command as it is, up to kSlowest times the told one,
///             and lags whose acceleration is bounded (torque: yaw gains its rate slowly where the step is large)
/// Each is held against the measured rates in the mean square over the last kMemory. A limit is known once the best of
/// the limited ones beats the best of all others by kLeastGain, and leaves less than kLeftOver of its mean square: only
/// a plateau does that. It is the mean rate that was measured on the plateau of the best, where the slowest lag has
/// come near its limit and more than the next higher one is asked for. It is forgotten when the same is true the other
/// way round.
/// Thread-safe: no (control step).   Real-time safe: yes (fixed work).
class RateLimits {
 public:
  static constexpr int kLimits = 12;
  static constexpr double kLowest = 0.12;  ///< the lowest limit that is looked for, of the told one
  static constexpr int kLags = 4;
  static constexpr double kLagSpan = 1.8;  ///< lags with a limit: told / kLagSpan to told * kLagSpan
  static constexpr int kFreeLags = 8;
  static constexpr double kSlowest = 4.0;  ///< lags without: told / kSlowest to told * kSlowest
  static constexpr int kBounded = 5;       ///< bounds of acceleration: told limit / told lag times 1/2, 1/4 ..
  static constexpr Stamp kMemory = std::chrono::seconds(2);
  static constexpr double kLeastGain_rad_s = 0.25;
  static constexpr double kLeftOver = 0.5;
  static constexpr double kOnPlateau = 0.9;  ///< of the limit: nearer is on it
  /// A limit below the told one times this is told to people.
  static constexpr double kUnlike = 0.85;

  /// @pre validate(told).ok() and told.kind is kBodyRates
  /// @param asked_at_most_rad_s  what is ever asked for, about each axis of B; more than 0
  RateLimits(const Actuation& told, const Eigen::Vector3d& asked_at_most_rad_s) noexcept;

  /// What was asked for during the next dt.
  void follow(const RateCommand& command, Stamp dt) noexcept;
  /// What the rates came to at the end of what was followed. @param dt  since the last observation
  void observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept;
  /// What was asked for is not known for a while: what follows begins anew from the measured rates.
  void interrupt(const Eigen::Vector3d& w_WB_B) noexcept;

  /// About each axis of B, rad/s; 0: not known, none was met.
  Eigen::Vector3d limit_rad_s() const noexcept;
  /// The command as the vehicle takes it.
  RateCommand limited(const RateCommand& command) const noexcept;
  /// Whether one is known that is below what is asked for at most.
  bool unlike_told() const noexcept;

 private:
  static constexpr int kModels = kLags * kLimits + kFreeLags + 2 * kBounded;
  struct Axis {
    double asked_at_most_rad_s = 0.0;
    std::array<double, kLimits> limit_rad_s{};  ///< geometric, rising
    std::array<double, kLags> lag_s{};
    std::array<double, kFreeLags> free_lag_s{};
    std::array<double, kBounded> acceleration_rad_s2{};
    std::array<double, 2> bounded_lag_s{};
    /// Limited ones first, lag by lag; then the free ones, then the bounded ones.
    std::array<double, kModels> response_rad_s{}, mean_square{};
    std::array<double, kLimits> plateau_rad_s{}, plateau_s{};  ///< mean rate on it, and for how long, up to kMemory
    double asked_rad_s = 0.0;
    double found_rad_s = 0.0;  ///< 0: none
  };
  static void see_plateaus(double measured_rad_s, double dt_s, Axis* axis) noexcept;
  static void decide(Axis* axis) noexcept;

  std::array<Axis, 3> axes_;
};

}  // namespace gatefield::pilot
