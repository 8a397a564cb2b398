#pragma once

#include <cstdint>
#include <optional>

#include "client/simulator/battery.h"
#include "common/config/hard_world.h"
#include "common/scene/world.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// What air and battery do to the true vehicle beyond the model that the planner shares (aerodynamic_wrench()).
///
/// Rotor thrust. `thrust_n` of a state says how fast a rotor turns: what it would give at rest, far from the floor, at
/// the voltage that the vehicle's thrust was told for. What it does give is
///   T = g (S - k sqrt(S) w),   S = b thrust_n,   within [0, 1.3 g S]
///   b   the battery's factor (battery.h);
///   w   speed of the rotor along its axis through the air. The thrust coefficient falls about straight with the advance
///       ratio J = w / (n D) from C_T at rest to 0 at J_0 (measured: Brandt and Selig, "Propeller Performance Data at
///       Low Reynolds Numbers", AIAA 2011-1255), so with S = C_T rho n^2 D^4:  k = sqrt(C_T rho) D / J_0;
///   g   ground effect, 1 / (1 - (R / 4h)^2) with the rotor's radius R and its height h above the floor, at least R
///       (Cheeseman and Bennett, "The Effect of the Ground on a Helicopter Rotor in Forward Flight", ARC R&M 3021,
///       1955).
/// Sinking into its own wake (the vortex ring) is not in it: there a rotor has more thrust here, to the bound.
///
/// Drag, on top of the linear one: F_B = -rho / 2 |v_B| diag(A_level, A_level, A_axial) v_B, the areas C_d A.
/// Thread-safe: no.   Real-time safe: yes.
class Aerodynamics {
 public:
  static constexpr double kAirDensity_kg_m3 = 1.2;
  static constexpr double kMostOfStatic = 1.3;

  /// @param model   the true vehicle
  /// @param world   its floor
  /// @param seed    draws the battery's charge
  /// Empty: there is nothing beyond the model.
  static std::optional<Aerodynamics> create(const config::AirErrors& air, const QuadrotorModel& model,
                                            const scene::World& world, std::uint64_t seed);

  /// What each rotor gives.
  PlainVector4 thrust_n(const QuadrotorState& state, const Eigen::Vector3d& wind_W_m_s) const noexcept;
  /// Force beyond the linear drag.
  Eigen::Vector3d drag_W(const QuadrotorState& state, const Eigen::Vector3d& wind_W_m_s) const noexcept;
  /// What a rotor at rest must be set to for this thrust, far from the floor.
  double setting_n(double thrust_n) const noexcept;
  /// A step with rotors at these settings goes by: the battery empties, and sags under their power from now on.
  void pass(const PlainVector4& thrust_n, double dt_s) noexcept;

  /// 1 without a battery.
  double battery_factor() const noexcept { return battery_factor_; }

 private:
  Aerodynamics(const config::AirErrors& air, const QuadrotorModel& model, const scene::World& world,
               std::uint64_t seed) noexcept;

  QuadrotorModel model_;
  Eigen::Vector3d drag_kg_m_;
  double inflow_ = 0.0;  ///< k
  double radius_m_;      ///< R
  bool ground_effect_;
  double floor_z_m_;
  std::optional<Battery> battery_;
  double battery_factor_ = 1.0;
};

}  // namespace gatefield::simulator
