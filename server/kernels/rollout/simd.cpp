#include <cmath>

#include "server/kernels/rollout/rigid_body.h"
#include "server/kernels/rollout/rollout.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/rollout/simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "server/kernels/rollout/rigid_body-inl.h"
#include "server/kernels/target.h"

#ifndef GATEFIELD_KERNELS_ROLLOUT_CONSTANTS
#define GATEFIELD_KERNELS_ROLLOUT_CONSTANTS
namespace gatefield::kernels {

/// The model with every product of constants taken, in single precision; the body's part in rigid_body.h.
struct RolloutConstants {
  RigidBodyConstants body;
  float dt, inverse_dt;
  float rate_max, thrust_min, thrust_max, time_constant, decay;
  float torque[3][kRotors];  ///< change of body rate per newton of rotor i over one step
  float gyro[3];             ///< w_x += gyro[0] w_y w_z, and so on round
  float start[21];           ///< p v q(wxyz) w thrust command
};

}  // namespace gatefield::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

void RolloutTile(const RolloutConstants& c, const SampleBlock& inputs, const SampleBlock& states, std::size_t first,
                 std::size_t lanes) {
  const D d;
  const std::size_t N = hn::Lanes(d);
  HWY_ALIGN_MAX float state[21][kTile];
  for (std::size_t row = 0; row < 21; ++row) {
    for (std::size_t m = 0; m < lanes; m += N) hn::Store(hn::Set(d, c.start[row]), d, &state[row][m]);
  }
  for (int k = 0; k < inputs.steps; ++k) {
    float* u_row[kInputs];
    float* out[kStateChannels];
    for (int i = 0; i < kInputs; ++i) u_row[i] = inputs.row(k, i) + first;
    for (int i = 0; i < kStateChannels; ++i) out[i] = states.row(k, i) + first;

    for (std::size_t m = 0; m < lanes; m += N) {
      // (1) rotors: the command is a clamped ramp, the thrust follows with a first-order lag
      V thrust[kRotors];
      V thrust_sum = hn::Zero(d), next_sum = hn::Zero(d);
      for (std::size_t i = 0; i < kRotors; ++i) {
        const V wanted = hn::LoadU(d, u_row[i] + m);
        const V number = hn::IfThenElseZero(hn::Eq(wanted, wanted), wanted);
        const V rate = Clamped(number, hn::Set(d, -c.rate_max), hn::Set(d, c.rate_max));
        const V old_thrust = hn::Load(d, &state[13 + i][m]);
        const V old_command = hn::Load(d, &state[17 + i][m]);
        const V command = Clamped(hn::MulAdd(rate, hn::Set(d, c.dt), old_command), hn::Set(d, c.thrust_min),
                                  hn::Set(d, c.thrust_max));
        const V applied = hn::Mul(hn::Sub(command, old_command), hn::Set(d, c.inverse_dt));
        const V lag = hn::Mul(applied, hn::Set(d, c.time_constant));
        const V next =
            hn::MulAdd(hn::Add(hn::Sub(old_thrust, old_command), lag), hn::Set(d, c.decay), hn::Sub(command, lag));
        thrust[i] = hn::Mul(hn::Set(d, 0.5f), hn::Add(old_thrust, next));
        thrust_sum = hn::Add(thrust_sum, thrust[i]);
        next_sum = hn::Add(next_sum, next);
        hn::StoreU(applied, d, u_row[i] + m);
        hn::Store(next, d, &state[13 + i][m]);
        hn::Store(command, d, &state[17 + i][m]);
      }

      // (2) body rates at the mean thrust; w x J w has one product per axis because J is diagonal
      const V wx = hn::Load(d, &state[10][m]), wy = hn::Load(d, &state[11][m]), wz = hn::Load(d, &state[12][m]);
      V nx = hn::MulAdd(hn::Mul(wy, wz), hn::Set(d, c.gyro[0]), wx);
      V ny = hn::MulAdd(hn::Mul(wz, wx), hn::Set(d, c.gyro[1]), wy);
      V nz = hn::MulAdd(hn::Mul(wx, wy), hn::Set(d, c.gyro[2]), wz);
      for (std::size_t i = 0; i < kRotors; ++i) {
        nx = hn::MulAdd(hn::Set(d, c.torque[0][i]), thrust[i], nx);
        ny = hn::MulAdd(hn::Set(d, c.torque[1][i]), thrust[i], ny);
        nz = hn::MulAdd(hn::Set(d, c.torque[2][i]), thrust[i], nz);
      }
      const V rate_limit = hn::Set(d, c.body.rate_limit), least_rate = hn::Set(d, -c.body.rate_limit);
      nx = Clamped(nx, least_rate, rate_limit);
      ny = Clamped(ny, least_rate, rate_limit);
      nz = Clamped(nz, least_rate, rate_limit);

      // (3) to (5)
      MoveBody(c.body, hn::Add(wx, nx), hn::Add(wy, ny), hn::Add(wz, nz), thrust_sum, state, out, m);

      const V next_rates[3] = {nx, ny, nz};
      for (std::size_t i = 0; i < 3; ++i) {
        hn::Store(next_rates[i], d, &state[10 + i][m]);
        hn::StoreU(next_rates[i], d, out[kWx + i] + m);
      }
      hn::StoreU(next_sum, d, out[kThrustSum] + m);
    }
  }
}

void RolloutAll(const RolloutConstants& c, const SampleBlock& inputs, const SampleBlock& states) {
  const std::size_t total = static_cast<std::size_t>(padded_samples(inputs.samples));
  for (std::size_t first = 0; first < total; first += kTile) {
    RolloutTile(c, inputs, states, first, HWY_MIN(kTile, total - first));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gatefield::kernels {

HWY_EXPORT(RolloutAll);

RolloutLoop* rollout_loop(std::int64_t target) noexcept { return GATEFIELD_OF_TARGET(RolloutAll, target); }

void rollout(RolloutLoop* loop, const QuadrotorModel& model, const QuadrotorState& start, double dt_s,
             SampleBlock inputs, SampleBlock states) noexcept {
  RolloutConstants c{};
  c.body = rigid_body_constants(model, dt_s);
  const auto f = [](double value) { return static_cast<float>(value); };
  c.dt = f(dt_s);
  c.inverse_dt = f(1.0 / dt_s);
  c.rate_max = f(model.thrust_rate_max_n_s);
  c.thrust_min = f(model.thrust_min_n);
  c.thrust_max = f(model.thrust_max_n);
  c.time_constant = f(model.rotor_time_constant_s);
  c.decay = f(std::exp(-dt_s / model.rotor_time_constant_s));
  const Eigen::Vector3d J = model.inertia_kg_m2;
  for (std::size_t i = 0; i < kRotors; ++i) {
    c.torque[0][i] = f(dt_s * model.rotor_position_B_m[i].y() / J.x());
    c.torque[1][i] = f(-dt_s * model.rotor_position_B_m[i].x() / J.y());
    c.torque[2][i] = f(dt_s * model.rotor_spin[i] * model.torque_per_thrust_m / J.z());
  }
  c.gyro[0] = f(dt_s * (J.y() - J.z()) / J.x());
  c.gyro[1] = f(dt_s * (J.z() - J.x()) / J.y());
  c.gyro[2] = f(dt_s * (J.x() - J.y()) / J.z());

  const QuadrotorState s = bounded(start, dt_s);
  lay_out_body(s, c.start);
  for (int i = 0; i < kRotors; ++i) {
    c.start[kBodyRows + i] = f(s.thrust_n[i]);
    c.start[kBodyRows + kRotors + i] = f(s.thrust_command_n[i]);
  }
  loop(c, inputs, states);
}

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
