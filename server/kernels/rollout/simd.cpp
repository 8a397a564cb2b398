#include <cmath>

#include "server/kernels/rollout/rollout.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/rollout/simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "server/kernels/target.h"

#ifndef GATEFIELD_KERNELS_ROLLOUT_CONSTANTS
#define GATEFIELD_KERNELS_ROLLOUT_CONSTANTS
namespace gatefield::kernels {

/// The model with every product of constants taken, in single precision.
struct RolloutConstants {
  float dt, inverse_dt, half_dt, quarter_dt;
  float rate_max, thrust_min, thrust_max, time_constant, decay;
  float torque[3][kRotors];  ///< change of body rate per newton of rotor i over one step
  float gyro[3];             ///< w_x += gyro[0] w_y w_z, and so on round
  float dt_over_mass, drag[3], gravity_dt;
  float position_limit, speed_limit, rate_limit;
  float start[21];  ///< p v q(wxyz) w thrust command
};

}  // namespace gatefield::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::VFromD<D>;

// Lanes of one tile: its 21 state rows stay in the first-level cache between steps, and its vectors, which don't depend
// on each other, keep the pipelines busy while one waits for a square root.
constexpr std::size_t kTile = 64;

HWY_INLINE V Clamped(V value, V low, V high) { return hn::Min(hn::Max(value, low), high); }

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
      const V rate_limit = hn::Set(d, c.rate_limit), least_rate = hn::Set(d, -c.rate_limit);
      nx = Clamped(nx, least_rate, rate_limit);
      ny = Clamped(ny, least_rate, rate_limit);
      nz = Clamped(nz, least_rate, rate_limit);

      // (3) half a step of rotation h = exp(dt/2 * mean w / 2), applied twice. With b = dt/4 * mean w and x = |b|^2 it
      // is (cos |b|, b sin|b|/|b|): both are power series in x. x <= 6.75 by the rate limit; the first terms left out
      // are below 2e-8.
      const V scale = hn::Set(d, 0.5f * c.quarter_dt);
      const V bx = hn::Mul(hn::Add(wx, nx), scale);
      const V by = hn::Mul(hn::Add(wy, ny), scale);
      const V bz = hn::Mul(hn::Add(wz, nz), scale);
      const V x = hn::MulAdd(bx, bx, hn::MulAdd(by, by, hn::Mul(bz, bz)));
      V cosine = hn::Set(d, 1.0f / 20922789888000.0f);
      cosine = hn::MulAdd(cosine, x, hn::Set(d, -1.0f / 87178291200.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, 1.0f / 479001600.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, -1.0f / 3628800.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, 1.0f / 40320.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, -1.0f / 720.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, 1.0f / 24.0f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, -0.5f));
      cosine = hn::MulAdd(cosine, x, hn::Set(d, 1.0f));
      V sinc = hn::Set(d, -1.0f / 1307674368000.0f);
      sinc = hn::MulAdd(sinc, x, hn::Set(d, 1.0f / 6227020800.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, -1.0f / 39916800.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, 1.0f / 362880.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, -1.0f / 5040.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, 1.0f / 120.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, -1.0f / 6.0f));
      sinc = hn::MulAdd(sinc, x, hn::Set(d, 1.0f));
      const V hx = hn::Mul(bx, sinc), hy = hn::Mul(by, sinc), hz = hn::Mul(bz, sinc);

      const V qw = hn::Load(d, &state[6][m]), qx = hn::Load(d, &state[7][m]);
      const V qy = hn::Load(d, &state[8][m]), qz = hn::Load(d, &state[9][m]);
      // q_mid = q * h, Hamilton product
      const V mw = hn::NegMulAdd(qx, hx, hn::NegMulAdd(qy, hy, hn::NegMulAdd(qz, hz, hn::Mul(qw, cosine))));
      const V mx = hn::MulAdd(qw, hx, hn::MulAdd(qy, hz, hn::NegMulAdd(qz, hy, hn::Mul(qx, cosine))));
      const V my = hn::MulAdd(qw, hy, hn::MulAdd(qz, hx, hn::NegMulAdd(qx, hz, hn::Mul(qy, cosine))));
      const V mz = hn::MulAdd(qw, hz, hn::MulAdd(qx, hy, hn::NegMulAdd(qy, hx, hn::Mul(qz, cosine))));
      V ew = hn::NegMulAdd(mx, hx, hn::NegMulAdd(my, hy, hn::NegMulAdd(mz, hz, hn::Mul(mw, cosine))));
      V ex = hn::MulAdd(mw, hx, hn::MulAdd(my, hz, hn::NegMulAdd(mz, hy, hn::Mul(mx, cosine))));
      V ey = hn::MulAdd(mw, hy, hn::MulAdd(mz, hx, hn::NegMulAdd(mx, hz, hn::Mul(my, cosine))));
      V ez = hn::MulAdd(mw, hz, hn::MulAdd(mx, hy, hn::NegMulAdd(my, hx, hn::Mul(mz, cosine))));
      const V norm2 = hn::MulAdd(ew, ew, hn::MulAdd(ex, ex, hn::MulAdd(ey, ey, hn::Mul(ez, ez))));
      const V inverse_norm = hn::Div(hn::Set(d, 1.0f), hn::Sqrt(norm2));
      ew = hn::Mul(ew, inverse_norm);
      ex = hn::Mul(ex, inverse_norm);
      ey = hn::Mul(ey, inverse_norm);
      ez = hn::Mul(ez, inverse_norm);

      // (4) velocity: R_WB of q_mid, thrust along its third column, drag on the body's axes
      const V two = hn::Set(d, 2.0f), one = hn::Set(d, 1.0f);
      const V x2 = hn::Mul(two, mx), y2 = hn::Mul(two, my), z2 = hn::Mul(two, mz);
      const V xx = hn::Mul(x2, mx), yy = hn::Mul(y2, my), zz = hn::Mul(z2, mz);
      const V xy = hn::Mul(x2, my), xz = hn::Mul(x2, mz), yz = hn::Mul(y2, mz);
      const V wx2 = hn::Mul(x2, mw), wy2 = hn::Mul(y2, mw), wz2 = hn::Mul(z2, mw);
      const V r00 = hn::Sub(one, hn::Add(yy, zz)), r01 = hn::Sub(xy, wz2), r02 = hn::Add(xz, wy2);
      const V r10 = hn::Add(xy, wz2), r11 = hn::Sub(one, hn::Add(xx, zz)), r12 = hn::Sub(yz, wx2);
      const V r20 = hn::Sub(xz, wy2), r21 = hn::Add(yz, wx2), r22 = hn::Sub(one, hn::Add(xx, yy));
      const V vx = hn::Load(d, &state[3][m]), vy = hn::Load(d, &state[4][m]), vz = hn::Load(d, &state[5][m]);
      const V vbx = hn::MulAdd(r00, vx, hn::MulAdd(r10, vy, hn::Mul(r20, vz)));
      const V vby = hn::MulAdd(r01, vx, hn::MulAdd(r11, vy, hn::Mul(r21, vz)));
      const V vbz = hn::MulAdd(r02, vx, hn::MulAdd(r12, vy, hn::Mul(r22, vz)));
      const V fx = hn::Mul(hn::Set(d, -c.drag[0]), vbx);
      const V fy = hn::Mul(hn::Set(d, -c.drag[1]), vby);
      const V fz = hn::NegMulAdd(hn::Set(d, c.drag[2]), vbz, hn::Mul(hn::Set(d, c.dt_over_mass), thrust_sum));
      V ux = hn::MulAdd(r00, fx, hn::MulAdd(r01, fy, hn::MulAdd(r02, fz, vx)));
      V uy = hn::MulAdd(r10, fx, hn::MulAdd(r11, fy, hn::MulAdd(r12, fz, vy)));
      V uz = hn::MulAdd(r20, fx, hn::MulAdd(r21, fy, hn::MulAdd(r22, fz, hn::Sub(vz, hn::Set(d, c.gravity_dt)))));
      const V speed_limit = hn::Set(d, c.speed_limit), least_speed = hn::Set(d, -c.speed_limit);
      ux = Clamped(ux, least_speed, speed_limit);
      uy = Clamped(uy, least_speed, speed_limit);
      uz = Clamped(uz, least_speed, speed_limit);

      // (5) position by the mean of old and new velocity
      const V half_dt = hn::Set(d, c.half_dt);
      const V limit = hn::Set(d, c.position_limit), least = hn::Set(d, -c.position_limit);
      const V px = Clamped(hn::MulAdd(hn::Add(vx, ux), half_dt, hn::Load(d, &state[0][m])), least, limit);
      const V py = Clamped(hn::MulAdd(hn::Add(vy, uy), half_dt, hn::Load(d, &state[1][m])), least, limit);
      const V pz = Clamped(hn::MulAdd(hn::Add(vz, uz), half_dt, hn::Load(d, &state[2][m])), least, limit);

      const V next_state[13] = {px, py, pz, ux, uy, uz, ew, ex, ey, ez, nx, ny, nz};
      for (std::size_t i = 0; i < 13; ++i) {
        hn::Store(next_state[i], d, &state[i][m]);
        hn::StoreU(next_state[i], d, out[i] + m);
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
  const auto f = [](double value) { return static_cast<float>(value); };
  c.dt = f(dt_s);
  c.inverse_dt = f(1.0 / dt_s);
  c.half_dt = f(0.5 * dt_s);
  c.quarter_dt = f(0.25 * dt_s);
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
  c.dt_over_mass = f(dt_s / model.mass_kg);
  for (int i = 0; i < 3; ++i) c.drag[i] = f(model.drag_kg_s[i] * dt_s / model.mass_kg);
  c.gravity_dt = f(kGravity_m_s2 * dt_s);
  c.position_limit = f(kPositionLimit_m);
  c.speed_limit = f(kSpeedLimit_m_s);
  c.rate_limit = f(rate_limit_rad_s(dt_s));

  const QuadrotorState s = bounded(start, dt_s);
  for (int i = 0; i < 3; ++i) {
    c.start[i] = f(s.p_WB[i]);
    c.start[3 + i] = f(s.v_WB[i]);
    c.start[10 + i] = f(s.w_WB_B[i]);
  }
  c.start[6] = f(s.q_WB.w());
  c.start[7] = f(s.q_WB.x());
  c.start[8] = f(s.q_WB.y());
  c.start[9] = f(s.q_WB.z());
  for (int i = 0; i < kRotors; ++i) {
    c.start[13 + i] = f(s.thrust_n[i]);
    c.start[17 + i] = f(s.thrust_command_n[i]);
  }
  loop(c, inputs, states);
}

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
