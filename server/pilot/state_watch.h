#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "common/base/clock.h"
#include "common/protocol/problems.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// Holds a vehicle's states against each other and against the model, and says which mistake explains it when they
/// contradict each other: what goes wrong otherwise is a crash within a second or two, and nobody knows why.
///
/// Over a window of the newest states (kWindow; the rotors' torques kTorqueWindow) three things are integrated and
/// compared, with tolerances that grow with what was integrated:
///   motion     p_n - p_0             against  sum v dt
///   thrust     v_n - v_0             against  sum (R z T / m - drag - g) dt
///   rotation   q_0^-1 q_n            against  prod exp(w dt)
///   torques    w_n - w_0             against  sum J^-1 (tau(T) - w x J w) dt
/// A contradiction that lasts for kEnough looks in a row is told (Problem::kVelocityAgainstMotion,
/// kThrustAgainstMotion, kRatesAgainstAttitude). Then each known mistake is undone in turn (NED and FRD, a quaternion w
/// first, a velocity in the body frame, rates in the world frame); the one that leaves far less than was told, and less
/// than the others, is the likely cause. Torques that don't fit are told only when another order of the rotors, or
/// other spins, fits, and no mistake in the states that makes them fit leaves the rest in agreement. A vehicle that
/// stands (on the floor, in a hand) contradicts nothing. A problem stays for kStays after it was last seen.
///
/// Thread-safe: no (control step).   Real-time safe: yes (fixed memory, bounded work, most of it once in kLookPeriod).
class StateWatch {
 public:
  static constexpr Stamp kWindow = std::chrono::milliseconds(240);
  static constexpr Stamp kTorqueWindow = std::chrono::milliseconds(100);
  static constexpr Stamp kLookPeriod = std::chrono::milliseconds(40);
  static constexpr Stamp kLongestGap = std::chrono::milliseconds(60);  ///< between neighbours; a longer one begins anew
  static constexpr Stamp kStays = std::chrono::seconds(2);
  static constexpr int kEnough = 3;

  /// @param rotors_known  states say each rotor's thrust; else only their sum means something, and torques are left out
  /// @pre validate(model).ok()
  explicit StateWatch(const QuadrotorModel& model, bool rotors_known = true) noexcept
      : model_(model), rotors_known_(rotors_known) {}

  /// Takes the next state. @param state  its rotors as measured, or as modelled by the caller
  /// @return what is wrong now. Stamps that don't rise begin anew.
  protocol::Problems observe(Stamp stamp, const QuadrotorState& state) noexcept;

 private:
  struct Sample {
    Stamp stamp{0};
    QuadrotorState state;
  };
  static constexpr std::size_t kCapacity = 64;
  static constexpr Stamp kLeastGap = kWindow / 48;  ///< nearer neighbours are left out

  const Sample& nth(std::size_t index) const noexcept { return ring_[(first_ + index) % kCapacity]; }
  void look(Stamp now) noexcept;
  bool rotors_look_swapped(Stamp now) const noexcept;
  void tell(Stamp now, protocol::Problem problem, bool seen) noexcept;

  QuadrotorModel model_;
  bool rotors_known_;
  std::array<Sample, kCapacity> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  Stamp next_look_{0};
  std::array<int, protocol::kProblems> in_a_row_{};
  std::array<Stamp, protocol::kProblems> until_{};
};

}  // namespace gatefield::pilot
