#pragma once

#include <array>
#include <cmath>

#include "common/vehicle/quadrotor.h"

namespace gatefield::test {

/// A quadrotor on a floor at z = 0, whose motors a RateController drives.
class RateBody {
 public:
  RateBody() { model.rotor_spin = {-1, -1, 1, 1}; }  // as RateController's mixer has them

  /// @param outputs  of the motors, 0 to 1: rear right, front right, rear left, front left
  void step(const std::array<double, 4>& outputs, double dt_s) {
    constexpr std::array<std::size_t, 4> kOutputOfRotor{1, 2, 3, 0};  // front right, rear left, front left, rear right
    for (std::size_t i = 0; i < 4; ++i)
      state.thrust_command_n[static_cast<Eigen::Index>(i)] =
          model.thrust_max_n * outputs[kOutputOfRotor[i]] * outputs[kOutputOfRotor[i]];
    const QuadrotorState before = state;
    state = step_reference(model, state, ThrustRates::Zero(), dt_s);
    on_ground = state.p_WB.z() <= 0.0;
    if (on_ground) {
      state.p_WB.z() = 0.0;
      state.v_WB = Eigen::Vector3d(0, 0, std::max(state.v_WB.z(), 0.0));
      state.w_WB_B.setZero();
    }
    const Eigen::Vector3d force_W = (state.v_WB - before.v_WB) / dt_s + Eigen::Vector3d(0, 0, kGravity_m_s2);
    specific_force_B = Eigen::Quaterniond(state.q_WB).inverse() * force_W;
    constexpr double kGate_x_m = 8.0, kGate_z_m = 1.5, kHalf_m = 0.5;
    if (before.p_WB.x() < kGate_x_m && state.p_WB.x() >= kGate_x_m)
      passed = std::abs(state.p_WB.y()) < kHalf_m && std::abs(state.p_WB.z() - kGate_z_m) < kHalf_m;
  }

  QuadrotorModel model;
  QuadrotorState state;
  bool on_ground = true;
  Eigen::Vector3d specific_force_B{0, 0, kGravity_m_s2};
  bool passed = false;  ///< the gate of course one-gate, inside of its opening
};

}  // namespace gatefield::test
