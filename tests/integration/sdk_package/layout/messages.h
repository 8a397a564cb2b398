#pragma once

#include <Eigen/Core>

/// What client and server of this test say to each other. Each makes it with its own compiler's flags.
/// A template, because the client knows the types by other headers than the server.
template <typename State>
State sent_state() {
  State state;
  state.p_WB = {1.5, -2.25, 3.125};
  state.v_WB = {4.5, 5.25, -6.125};
  state.q_WB = {0.5, 0.5, -0.5, 0.5};  // w x y z
  state.w_WB_B = {0.25, -0.5, 1.75};
  state.thrust_n = {2.0, 2.25, 2.5, 2.75};
  state.thrust_command_n = {2.125, 2.375, 2.625, 2.875};
  return state;
}

template <typename State>
bool same(const State& a, const State& b) {
  return a.p_WB == b.p_WB && a.v_WB == b.v_WB && a.q_WB.coeffs() == b.q_WB.coeffs() && a.w_WB_B == b.w_WB_B &&
         a.thrust_n == b.thrust_n && a.thrust_command_n == b.thrust_command_n;
}

/// Rotor thrusts at the end of interval k of the answer.
inline Eigen::Vector4d answered_thrust_n(int k) { return Eigen::Vector4d(2, 2.5, 3, 3.5).array() + 0.25 * k; }
