#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::flight {

/// What is known of throttle and thrust before the flight.
struct ThrustOptions {
  double hover_throttle = 0.30;  ///< 0 to 1: what holds the weight in the air at reference_v; 0.03 to 0.9
  double exponent = 1.7;         ///< thrust goes as throttle to this power: 1 (linear) to 2.5; 2 = speed to throttle
  double reference_v = 0.0;      ///< battery at which hover_throttle holds; 0: the firmware makes up for the battery,
                                 ///< or it is not known
  double throttle_min = 0.02;    ///< never less than this while flying; 0 to 0.5
  double throttle_max = 0.95;    ///< nor more; throttle_min + 0.1 to 1
  double lag_s = 0.04;           ///< from a throttle sent to the thrust felt: link, loop and rotors; 0 to 0.3
  double trusted_factor = 1.3;   ///< a thrust off by more than this contradicts the configuration; 1.05 to 3
};

/// Says which field is wrong and why.
Status validate(const ThrustOptions& options);

/// Collective thrust against normalised throttle, learned in flight from the throttle sent and the specific force felt.
///
///   F(u, V) = m g e^a (u V / (u_0 V_0))^p          u throttle, V battery, u_0 and V_0 as configured
///   ln(F / (m g)) = a + p xi,   xi = ln(u V / (u_0 V_0))
///
/// is linear in (a, p): a Kalman filter of two states, both random walks (a more than p), begun at a = 0 and the
/// configured exponent. What is felt is F / m = f_z + d_z v_z / m, the accelerometer along z of B and the drag that
/// hides thrust from it. Throttle passes the lag before it is compared, and both the same smoothing of kSmooth_s.
/// A hover says nothing of the exponent, which keeps its uncertainty then; accelerating says both.
///
/// Not learned from: throttle at its limits or just there before (the mixer gives something else), less than a fifth
/// of gravity, samples beyond three standard deviations (a contact, a gust), and anything before begin(). When
/// kRestart_s brought nothing but outliers, the uncertainty is that of the beginning again. The hover throttle stays
/// within a factor of kMaxFactor of the configured one, the exponent from 1 to 2.5.
///
/// Hover thrust as a state goes back to PX4's estimator (mc_hover_thrust_estimator), which has that one state and a
/// fixed curve.
///
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; what is not finite is left out.
class ThrustEstimate {
 public:
  static constexpr double kSmooth_s = 0.05;
  static constexpr double kRestart_s = 1.0;
  static constexpr double kMaxFactor = 3.0;

  /// @pre validate(options), validate(model)
  ThrustEstimate(const ThrustOptions& options, const QuadrotorModel& model) noexcept;

  /// Throttle that gives this collective thrust with the battery as it is, within the limits; taken as sent at `now`.
  /// @param collective_n  not finite or below 0: throttle_min
  double command(Stamp now, double collective_n) noexcept;
  /// The same without taking it as sent.
  double throttle(double collective_n) const noexcept;
  /// Thrust that a throttle gives, N.
  double collective_n(double throttle) const noexcept;

  /// The vehicle has left the ground: from here on it learns. end(): it is back, or somebody else flies.
  void begin() noexcept { learning_ = true; }
  void end() noexcept;

  /// Battery of the whole pack, V. Smoothed; more than half of reference_v away it is left out.
  void on_battery(double battery_v) noexcept;
  /// What is felt.
  /// @param specific_force_z_m_s2  accelerometer; empty: from the change of the states' velocities
  void on_state(Stamp stamp, const QuadrotorState& state, std::optional<double> specific_force_z_m_s2) noexcept;

  /// Throttle that holds the weight at reference_v.
  double hover_throttle() const noexcept;
  double exponent() const noexcept { return x_[1]; }
  /// True thrust over the thrust that the configuration would have at the configured hover throttle: 1.1 = 10 %
  /// stronger than told.
  double factor() const noexcept;
  /// One standard deviation of ln factor().
  double uncertainty() const noexcept;
  /// Samples that were taken, and that were outliers.
  std::uint64_t taken() const noexcept { return taken_; }
  std::uint64_t outliers() const noexcept { return outliers_; }
  /// factor() is beyond trusted_factor, either way, by more than two standard deviations.
  bool contradicts() const noexcept;

 private:
  struct Smoothed {
    double throttle = 0.0, force = 0.0;
  };
  std::optional<double> felt(Stamp stamp, const QuadrotorState& state, std::optional<double> specific_force) noexcept;
  void learn(double xi, double log_force, double sigma, double dt_s) noexcept;
  void keep_within_bounds() noexcept;
  double voltage_ratio() const noexcept;

  ThrustOptions options_;
  double mass_kg_, drag_z_kg_s_;
  Eigen::Vector2d x_;  // (a, p)
  Eigen::Matrix2d P_;
  std::optional<double> battery_v_;

  bool learning_ = false;
  struct Sent {
    Stamp when{0};
    double throttle = 0.0;
  };
  std::optional<Sent> sent_;          // the newest throttle
  double lagged_throttle_ = 0.0;      // what the thrust follows now, times the ratio of voltages
  double free_for_s_ = 0.0;           // since the throttle was last at a limit
  std::optional<Smoothed> smoothed_;  // empty: nothing felt since begin()
  std::optional<Stamp> felt_at_;
  std::optional<Eigen::Vector3d> velocity_;  // of the state at felt_at_
  double only_outliers_s_ = 0.0;
  std::uint64_t taken_ = 0, outliers_ = 0;
};

/// What to tell a person when the estimate contradicts the configuration: field, value, what flight shows and what to
/// look at. Ok when it does not. Not real-time safe.
Status agreement(const ThrustEstimate& estimate, const ThrustOptions& options);

}  // namespace gatefield::flight
