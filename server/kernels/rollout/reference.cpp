#include <algorithm>
#include <cmath>

#include "server/kernels/rollout/rollout.h"

namespace gatefield::kernels {
namespace {

double finite_within(double value, double limit, double otherwise = 0.0) noexcept {
  return std::isfinite(value) ? std::clamp(value, -limit, limit) : otherwise;
}

Eigen::Vector3d within(const Eigen::Vector3d& value, double limit) noexcept {
  return value.unaryExpr([limit](double x) { return std::clamp(x, -limit, limit); });
}

}  // namespace

double rate_limit_rad_s(double dt_s) noexcept { return std::min(kRateLimit_rad_s, kTurnPerStepLimit_rad / dt_s); }

QuadrotorState bounded(const QuadrotorState& start, double dt_s) noexcept {
  QuadrotorState state = start;
  for (int i = 0; i < 3; ++i) {
    state.p_WB[i] = finite_within(start.p_WB[i], kPositionLimit_m);
    state.v_WB[i] = finite_within(start.v_WB[i], kSpeedLimit_m_s);
    state.w_WB_B[i] = finite_within(start.w_WB_B[i], rate_limit_rad_s(dt_s));
  }
  for (int i = 0; i < kRotors; ++i) {
    state.thrust_n[i] = finite_within(start.thrust_n[i], kThrustLimit_n);
    state.thrust_command_n[i] = finite_within(start.thrust_command_n[i], kThrustLimit_n);
  }
  const double norm = start.q_WB.coeffs().norm();
  state.q_WB = std::isfinite(norm) && norm > 1e-6 ? start.q_WB.normalized() : Eigen::Quaterniond::Identity();
  return state;
}

QuadrotorState saturated(const QuadrotorState& state, double dt_s) noexcept {
  QuadrotorState inside = state;
  inside.p_WB = within(state.p_WB, kPositionLimit_m);
  inside.v_WB = within(state.v_WB, kSpeedLimit_m_s);
  inside.w_WB_B = within(state.w_WB_B, rate_limit_rad_s(dt_s));
  return inside;
}

void put_state(const QuadrotorState& state, SampleBlock states, int k, int m) noexcept {
  const auto put = [&](int channel, double value) { states.row(k, channel)[m] = static_cast<float>(value); };
  put(kPx, state.p_WB.x());
  put(kPy, state.p_WB.y());
  put(kPz, state.p_WB.z());
  put(kVx, state.v_WB.x());
  put(kVy, state.v_WB.y());
  put(kVz, state.v_WB.z());
  put(kQw, state.q_WB.w());
  put(kQx, state.q_WB.x());
  put(kQy, state.q_WB.y());
  put(kQz, state.q_WB.z());
  put(kWx, state.w_WB_B.x());
  put(kWy, state.w_WB_B.y());
  put(kWz, state.w_WB_B.z());
  put(kThrustSum, state.thrust_n.sum());
}

void rollout_reference(const QuadrotorModel& model, const QuadrotorState& start, double dt_s, SampleBlock inputs,
                       SampleBlock states) noexcept {
  const int lanes = padded_samples(inputs.samples);
  for (int m = 0; m < lanes; ++m) {
    QuadrotorState state = bounded(start, dt_s);
    for (int k = 0; k < inputs.steps; ++k) {
      ThrustRates u;
      for (int i = 0; i < kInputs; ++i) {
        const double wanted = inputs.row(k, i)[m];
        u[i] = std::isnan(wanted) ? 0.0 : wanted;
      }
      const QuadrotorState next = saturated(step_planner(model, state, u, dt_s), dt_s);
      for (int i = 0; i < kInputs; ++i) {
        inputs.row(k, i)[m] = static_cast<float>((next.thrust_command_n[i] - state.thrust_command_n[i]) / dt_s);
      }
      put_state(next, states, k, m);
      state = next;
    }
  }
}

}  // namespace gatefield::kernels
