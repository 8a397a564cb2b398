#include <algorithm>
#include <cmath>

#include "server/kernels/rollout/rates.h"

namespace gatefield::kernels {

RateCommand bounded(const RateRollout& how, const RateCommand& asked) noexcept {
  RateCommand within;
  for (int i = 0; i < 4; ++i)
    within[i] =
        std::isfinite(asked[i]) ? std::clamp(asked[i], how.low[i], how.high[i]) : 0.5 * (how.low[i] + how.high[i]);
  return within;
}

void rollout_rates_reference(const RateRollout& how, const QuadrotorState& start, const RateCommand& asked, double dt_s,
                             SampleBlock inputs, SampleBlock states) noexcept {
  const int lanes = padded_samples(inputs.samples);
  for (int m = 0; m < lanes; ++m) {
    QuadrotorState state = bounded(start, dt_s);
    RateCommand before = bounded(how, asked);
    for (int k = 0; k < inputs.steps; ++k) {
      RateCommand next;
      for (int i = 0; i < kInputs; ++i) {
        const double wanted = inputs.row(k, i)[m];
        const double value = how.inputs == RateInputs::kCommands
                                 ? (std::isnan(wanted) ? before[i] : wanted)
                                 : before[i] + (std::isnan(wanted) ? 0.0 : wanted * dt_s);
        next[i] = std::clamp(value, how.low[i], how.high[i]);
        const double applied = how.inputs == RateInputs::kCommands ? next[i] : (next[i] - before[i]) / dt_s;
        inputs.row(k, i)[m] = static_cast<float>(applied);
      }
      const RateCommand& from = how.inputs == RateInputs::kCommands ? next : before;
      state = saturated(step_body_rates(how.model, how.actuation, state, from, next, dt_s, how.thrust_factor), dt_s);
      before = next;
      put_state(state, states, k, m);
    }
  }
}

}  // namespace gatefield::kernels
