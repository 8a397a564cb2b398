#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "client/simulator/aerodynamics.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/scene/world.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::simulator {

/// What the vehicle's sphere touches.
struct Contact {
  enum class With { kGate, kFloor, kClutter };
  With with = With::kGate;
  int index = 0;  ///< of the gate or the clutter box in the world
};

/// The flying vehicle: MuJoCo integrates the rigid body and finds contacts, our rotor model and drag act on it as a
/// wrench.
///
/// One step of 1 ms: rotors exactly (step_rotors), then the wrench of the mean thrust of the step at the body's
/// half-step attitude and velocity (so that the wrench, which MuJoCo holds over the step, is right to second order),
/// then MuJoCo's RK4. Thread-safe: no (one thread at a time).   Real-time safe: step() yes (no allocation), create()
/// no.
class Plant {
 public:
  static constexpr Stamp kStep = std::chrono::milliseconds(1);

  /// @param model  the vehicle as it truly is
  /// @param air    what air and battery do beyond the model; empty: nothing
  /// Errors: a world that MuJoCo can't take (its sentence).
  static Result<std::unique_ptr<Plant>> create(const scene::World& world, const QuadrotorModel& model,
                                               const Eigen::Vector3d& wind_W_m_s = Eigen::Vector3d::Zero(),
                                               const std::optional<Aerodynamics>& air = std::nullopt);
  ~Plant();
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// Puts the vehicle somewhere; time goes on from where it was.
  void set_state(const QuadrotorState& state) noexcept;
  const QuadrotorState& state() const noexcept { return state_; }
  /// What each rotor must be set to for the vehicle to hover now, far from the floor.
  PlainVector4 hover_setting_n() const noexcept;
  /// Simulated time since creation.
  Stamp time() const noexcept { return time_; }

  /// Advances by kStep under the commanded thrust rates.
  void step(const ThrustRates& u) noexcept;
  /// Advances by kStep with rotors that are asked for these thrusts (cut to what they can give) all the time, as a
  /// flight controller does: their lag is all that keeps them from jumping there. The limit of thrust rates is one of
  /// the planner's input, not of rotors.
  void step_held(const PlainVector4& thrust_command_n) noexcept;

  /// What the vehicle touches after the last step; the deepest contact if there are several.
  std::optional<Contact> contact() const noexcept { return contact_; }

 private:
  struct Physics;
  Plant(std::unique_ptr<Physics> physics, const QuadrotorModel& model, const Eigen::Vector3d& wind_W_m_s,
        const std::optional<Aerodynamics>& air);
  Wrench wrench(const QuadrotorState& state) const noexcept;
  /// The body's step, during which the rotors come to what `rotors` says of them.
  void step_body(const QuadrotorState& rotors) noexcept;
  void read_back() noexcept;

  std::unique_ptr<Physics> physics_;
  QuadrotorModel model_;
  Eigen::Vector3d wind_W_m_s_;
  std::optional<Aerodynamics> air_;
  QuadrotorState state_;
  Stamp time_{0};
  std::optional<Contact> contact_;
};

}  // namespace gatefield::simulator
