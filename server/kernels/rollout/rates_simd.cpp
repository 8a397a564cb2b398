#include <algorithm>
#include <cmath>

#include "server/kernels/rollout/rates.h"
#include "server/kernels/rollout/rigid_body.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "server/kernels/rollout/rates_simd.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "server/kernels/rollout/rigid_body-inl.h"
#include "server/kernels/target.h"

#ifndef GATEFIELD_KERNELS_RATE_CONSTANTS
#define GATEFIELD_KERNELS_RATE_CONSTANTS
namespace gatefield::kernels {

/// A RateRollout with every product of constants taken, in single precision. [4]: collective thrust, body rates.
struct RateConstants {
  RigidBodyConstants body;
  bool changes;
  float dt, inverse_dt;
  float low[4], high[4];
  float lag[4];       ///< how far a response stays behind a ramp of 1 per second, s: the time constant
  float decay[4];     ///< what is left of a difference after a step
  float mean[4];      ///< and on average during it
  float mean_lag[4];  ///< half a step less the time constant
  float start[kBodyRows];
  float thrust, asked[4];
};

}  // namespace gatefield::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace gatefield::kernels {
namespace HWY_NAMESPACE {

template <bool kChanges>
void RollOutTile(const RateConstants& c, const SampleBlock& inputs, const SampleBlock& states, std::size_t first,
                 std::size_t lanes) {
  constexpr std::size_t kThrustRow = kBodyRows, kAskedRow = kBodyRows + 1;
  const D d;
  const std::size_t N = hn::Lanes(d);
  HWY_ALIGN_MAX float state[kBodyRows + 5][kTile];
  for (std::size_t m = 0; m < lanes; m += N) {
    for (std::size_t row = 0; row < kBodyRows; ++row) hn::Store(hn::Set(d, c.start[row]), d, &state[row][m]);
    hn::Store(hn::Set(d, c.thrust), d, &state[kThrustRow][m]);
    for (std::size_t i = 0; i < 4; ++i) hn::Store(hn::Set(d, c.asked[i]), d, &state[kAskedRow + i][m]);
  }
  // Where what follows a command lies among the rows.
  constexpr std::size_t kFollows[4] = {kThrustRow, 10, 11, 12};
  for (int k = 0; k < inputs.steps; ++k) {
    float* input[kInputs];
    float* out[kStateChannels];
    for (int i = 0; i < kInputs; ++i) input[i] = inputs.row(k, i) + first;
    for (int i = 0; i < kStateChannels; ++i) out[i] = states.row(k, i) + first;

    for (std::size_t m = 0; m < lanes; m += N) {
      // (1), (2) each of the four follows its command exactly: the end value, and the mean over the step
      V end[4], mean[4];
      for (std::size_t i = 0; i < 4; ++i) {
        const V wanted = hn::LoadU(d, input[i] + m);
        const V before = hn::Load(d, &state[kAskedRow + i][m]);
        const V low = hn::Set(d, c.low[i]), high = hn::Set(d, c.high[i]);
        const V x = hn::Load(d, &state[kFollows[i]][m]);
        const auto number = hn::Eq(wanted, wanted);
        V asked;
        if constexpr (kChanges) {
          asked = Clamped(hn::MulAdd(hn::IfThenElseZero(number, wanted), hn::Set(d, c.dt), before), low, high);
          const V slope = hn::Mul(hn::Sub(asked, before), hn::Set(d, c.inverse_dt));
          const V behind = hn::MulAdd(slope, hn::Set(d, c.lag[i]), hn::Sub(x, before));
          end[i] = hn::MulAdd(behind, hn::Set(d, c.decay[i]), hn::NegMulAdd(slope, hn::Set(d, c.lag[i]), asked));
          mean[i] = hn::MulAdd(behind, hn::Set(d, c.mean[i]), hn::MulAdd(slope, hn::Set(d, c.mean_lag[i]), before));
          hn::StoreU(slope, d, input[i] + m);
        } else {
          asked = Clamped(hn::IfThenElse(number, wanted, before), low, high);
          const V behind = hn::Sub(x, asked);
          end[i] = hn::MulAdd(behind, hn::Set(d, c.decay[i]), asked);
          mean[i] = hn::MulAdd(behind, hn::Set(d, c.mean[i]), asked);
          hn::StoreU(asked, d, input[i] + m);
        }
        hn::Store(asked, d, &state[kAskedRow + i][m]);
      }
      hn::Store(end[0], d, &state[kThrustRow][m]);
      hn::StoreU(end[0], d, out[kThrustSum] + m);

      // (3) to (5)
      const V two = hn::Set(d, 2.0f);
      MoveBody(c.body, hn::Mul(two, mean[1]), hn::Mul(two, mean[2]), hn::Mul(two, mean[3]), mean[0], state, out, m);
      for (std::size_t i = 0; i < 3; ++i) {
        hn::Store(end[1 + i], d, &state[10 + i][m]);
        hn::StoreU(end[1 + i], d, out[kWx + i] + m);
      }
    }
  }
}

void RollOutRates(const RateConstants& c, const SampleBlock& inputs, const SampleBlock& states) {
  const std::size_t total = static_cast<std::size_t>(padded_samples(inputs.samples));
  for (std::size_t first = 0; first < total; first += kTile) {
    const std::size_t lanes = HWY_MIN(kTile, total - first);
    if (c.changes) {
      RollOutTile<true>(c, inputs, states, first, lanes);
    } else {
      RollOutTile<false>(c, inputs, states, first, lanes);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace gatefield::kernels
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gatefield::kernels {

HWY_EXPORT(RollOutRates);

RateLoop* rate_loop(std::int64_t target) noexcept { return GATEFIELD_OF_TARGET(RollOutRates, target); }

void rollout_rates(RateLoop* loop, const RateRollout& how, const QuadrotorState& start, const RateCommand& asked,
                   double dt_s, SampleBlock inputs, SampleBlock states) noexcept {
  const auto f = [](double value) { return static_cast<float>(value); };
  RateConstants c{};
  c.body = rigid_body_constants(how.model, dt_s, how.thrust_factor);
  c.changes = how.inputs == RateInputs::kChanges;
  c.dt = f(dt_s);
  c.inverse_dt = f(1.0 / dt_s);
  const QuadrotorState s = bounded(start, dt_s);
  const RateCommand a = bounded(how, asked);
  const double turn_limit = rate_limit_rad_s(dt_s);
  for (int i = 0; i < 4; ++i) {
    const double lag_s = i == 0 ? how.actuation.thrust_time_constant_s : how.actuation.rate_time_constant_s[i - 1];
    const double limit = i == 0 ? kRotors * kThrustLimit_n : turn_limit;
    c.low[i] = f(std::max(how.low[i], -limit));
    c.high[i] = f(std::min(how.high[i], limit));
    c.lag[i] = f(lag_s);
    c.decay[i] = f(std::exp(-dt_s / lag_s));
    c.mean[i] = f(-lag_s / dt_s * std::expm1(-dt_s / lag_s));
    c.mean_lag[i] = f(0.5 * dt_s - lag_s);
    c.asked[i] = f(a[i]);
  }
  lay_out_body(s, c.start);
  c.thrust = f(s.thrust_n.sum());
  loop(c, inputs, states);
}

}  // namespace gatefield::kernels
#endif  // HWY_ONCE
