#include "server/pilot/predictor.h"

#include <algorithm>
#include <cmath>

namespace gatefield::pilot {
namespace {

constexpr std::chrono::nanoseconds kLongestStep = std::chrono::milliseconds(10);

}  // namespace

void predict(const Dynamics& dynamics, const InputTimeline& inputs, Stamp from, Stamp to,
             const Eigen::Vector3d& disturbance_W_m_s2, QuadrotorState* state) noexcept {
  const bool by_rates = dynamics.actuation.kind == Actuation::Kind::kBodyRates;
  inputs.visit(from, to, [&](const PlainVector4& input, Stamp begin, Stamp end) {
    while (begin < end) {
      const Stamp dt = std::min<Stamp>(end - begin, kLongestStep);
      const double dt_s = seconds(dt);
      *state = by_rates ? step_body_rates(dynamics.model, dynamics.actuation, *state, input, input, dt_s,
                                          dynamics.thrust_factor)
                        : step_reference(dynamics.model, *state, input, dt_s);
      state->p_WB += 0.5 * dt_s * dt_s * disturbance_W_m_s2;
      state->v_WB += dt_s * disturbance_W_m_s2;
      begin += dt;
    }
  });
}

void predict_rotors(const Dynamics& dynamics, const InputTimeline& inputs, Stamp from, Stamp to,
                    QuadrotorState* state) noexcept {
  const bool by_rates = dynamics.actuation.kind == Actuation::Kind::kBodyRates;
  inputs.visit(from, to, [&](const PlainVector4& input, Stamp begin, Stamp end) {
    const double dt_s = seconds(end - begin);
    if (by_rates) {
      *state = step_body_rates(dynamics.model, dynamics.actuation, *state, input, input, dt_s);
    } else {
      step_rotors(dynamics.model, input, dt_s, state);
    }
  });
}

void DelayEstimate::take(std::chrono::nanoseconds measured, double first_deviation, Mean* mean) noexcept {
  const double x = seconds(std::min(measured, kLongest));
  if (mean->count++ == 0) {
    mean->value = x;
    mean->deviation = first_deviation * std::abs(x);
    return;
  }
  const double weight = mean->count < 20 ? 0.25 : 0.1;
  mean->deviation += weight * (std::abs(x - mean->value) - mean->deviation);
  mean->value += weight * (x - mean->value);
}

std::chrono::nanoseconds DelayEstimate::network() const noexcept {
  if (state_.round_trip.count == 0) return std::chrono::nanoseconds{0};
  return std::clamp<std::chrono::nanoseconds>(from_seconds(state_.round_trip.value - state_.residence.value),
                                              std::chrono::nanoseconds{0}, kMaxDelay);
}

std::chrono::nanoseconds DelayEstimate::ahead() const noexcept {
  return std::min<std::chrono::nanoseconds>(network() + from_seconds(state_.solve.value + 2.0 * state_.solve.deviation),
                                            kMaxDelay);
}

std::chrono::nanoseconds DelayEstimate::whole() const noexcept {
  return std::min<std::chrono::nanoseconds>(from_seconds(state_.round_trip.value + 2.0 * state_.round_trip.deviation),
                                            kMaxDelay);
}

}  // namespace gatefield::pilot
