#include "server/kernels/rollout/rigid_body.h"

#include "server/kernels/rollout/rollout.h"

namespace gatefield::kernels {

RigidBodyConstants rigid_body_constants(const QuadrotorModel& model, double dt_s, double thrust_factor) noexcept {
  const auto f = [](double value) { return static_cast<float>(value); };
  RigidBodyConstants c{};
  c.half_dt = f(0.5 * dt_s);
  c.quarter_dt = f(0.25 * dt_s);
  c.dt_over_mass = f(thrust_factor * dt_s / model.mass_kg);
  for (int i = 0; i < 3; ++i) c.drag[i] = f(model.drag_kg_s[i] * dt_s / model.mass_kg);
  c.gravity_dt = f(kGravity_m_s2 * dt_s);
  c.position_limit = f(kPositionLimit_m);
  c.speed_limit = f(kSpeedLimit_m_s);
  c.rate_limit = f(rate_limit_rad_s(dt_s));
  return c;
}

void lay_out_body(const QuadrotorState& state, float* rows) noexcept {
  const auto f = [](double value) { return static_cast<float>(value); };
  for (int i = 0; i < 3; ++i) {
    rows[i] = f(state.p_WB[i]);
    rows[3 + i] = f(state.v_WB[i]);
    rows[10 + i] = f(state.w_WB_B[i]);
  }
  rows[6] = f(state.q_WB.w());
  rows[7] = f(state.q_WB.x());
  rows[8] = f(state.q_WB.y());
  rows[9] = f(state.q_WB.z());
}

}  // namespace gatefield::kernels
