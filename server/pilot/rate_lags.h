#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/base/clock.h"
#include "common/vehicle/actuation.h"

namespace gatefield::pilot {

/// How far a vehicle's body rates stay behind what is asked for, identified from the flight itself. Beside the lag that
/// was told run first-order responses with others, from a third of it to three times, each from the commands alone, so
/// that no noise of a measurement is fed back; the lag is the one whose response lies nearest to the measured rates, in
/// the mean square over the last kMemory, with a parabola through its neighbours.
/// Thread-safe: no (control step).   Real-time safe: yes (fixed work).
class RateLags {
 public:
  static constexpr int kCandidates = 9;
  static constexpr double kSpan = 3.0;  ///< the outermost candidates are told * kSpan and told / kSpan
  static constexpr Stamp kMemory = std::chrono::seconds(2);
  /// Nothing is said before as much was seen, and as long as the command's own mean square change is below
  /// kLeastMotion.
  static constexpr Stamp kWarmUp = std::chrono::milliseconds(1500);
  static constexpr double kLeastMotion_rad_s = 0.3;
  /// A loop that overshoots a little follows what changes slowly more closely than the time in which 63 % of its step
  /// are there: by this part of it. A lag farther from that than by the factor kUnlike is told to people.
  static constexpr double kOfStep = 0.8;
  static constexpr double kUnlike = 1.4;

  /// @pre validate(told).ok() and told.kind is kBodyRates
  explicit RateLags(const Actuation& told) noexcept;

  /// What was asked for during the next dt.
  void follow(const RateCommand& command, Stamp dt) noexcept;
  /// What the rates came to at the end of what was followed. @param dt  since the last observation
  void observe(const Eigen::Vector3d& w_WB_B, Stamp dt) noexcept;
  /// What was asked for is not known for a while: what follows begins anew from the measured rates.
  void interrupt(const Eigen::Vector3d& w_WB_B) noexcept;

  /// The lag about an axis of B, s; empty: not known yet.
  std::optional<double> lag_s(int axis) const noexcept;
  /// Whether one about x or y (yaw is bounded by torque, and slower for large steps) is known and unlike what was told.
  bool unlike_told() const noexcept;

 private:
  struct Axis {
    double told_s = 0.0;
    std::array<double, kCandidates> candidate_s{};  ///< geometric, rising
    std::array<double, kCandidates> response_rad_s{}, mean_square{};
    double motion = 0.0;  ///< mean square of what is asked for less the slowest response
    double asked_rad_s = 0.0;
  };

  std::array<Axis, 3> axes_;
  Stamp observed_{0};
};

}  // namespace gatefield::pilot
