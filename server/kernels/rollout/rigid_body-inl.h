// Included once per Highway target, by the rollouts; so no #pragma once.
#if defined(GATEFIELD_KERNELS_RIGID_BODY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef GATEFIELD_KERNELS_RIGID_BODY_INL_H
#undef GATEFIELD_KERNELS_RIGID_BODY_INL_H
#else
#define GATEFIELD_KERNELS_RIGID_BODY_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "server/kernels/rollout/rigid_body.h"
#include "server/kernels/rollout/rollout.h"

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<float>;
using V = hn::VFromD<D>;

// Lanes of one tile: its state rows stay in the first-level cache between steps, and its vectors, which don't depend on
// each other, keep the pipelines busy while one waits for a square root.
constexpr std::size_t kTile = 64;

HWY_INLINE V Clamped(V value, V low, V high) { return hn::Min(hn::Max(value, low), high); }

/// Steps (3) to (5) of gatefield::step_planner for the lanes at m: attitude, velocity, position.
/// @param twice_x, twice_y, twice_z  twice the mean body rates of the step
/// @param thrust                     the mean collective thrust of the step, N
/// @param state                      rows p, v, q(wxyz), moved on
/// @param out                        the same rows of the batch, written
HWY_INLINE void MoveBody(const RigidBodyConstants& c, V twice_x, V twice_y, V twice_z, V thrust, float (*state)[kTile],
                         float* const* out, std::size_t m) {
  const D d;
  // (3) half a step of rotation h = exp(dt/2 * mean w / 2), applied twice. With b = dt/4 * mean w and x = |b|^2 it
  // is (cos |b|, b sin|b|/|b|): both are power series in x. x <= 6.75 by the rate limit; the first terms left out
  // are below 2e-8.
  const V scale = hn::Set(d, 0.5f * c.quarter_dt);
  const V bx = hn::Mul(twice_x, scale);
  const V by = hn::Mul(twice_y, scale);
  const V bz = hn::Mul(twice_z, scale);
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
  const V fz = hn::NegMulAdd(hn::Set(d, c.drag[2]), vbz, hn::Mul(hn::Set(d, c.dt_over_mass), thrust));
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

  const V next_state[10] = {px, py, pz, ux, uy, uz, ew, ex, ey, ez};
  for (std::size_t i = 0; i < 10; ++i) {
    hn::Store(next_state[i], d, &state[i][m]);
    hn::StoreU(next_state[i], d, out[i] + m);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#endif
