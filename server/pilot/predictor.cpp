#include "server/pilot/predictor.h"

#include <algorithm>
#include <cmath>

namespace gatefield::pilot {
namespace {

constexpr std::chrono::nanoseconds kLongestStep = std::chrono::milliseconds(10);

}  // namespace

void InputTimeline::add(Stamp plan_start, Stamp step, std::span<const ThrustRates> rates, Stamp validity) noexcept {
  while (count_ > 0 && nth(count_ - 1).from >= plan_start) --count_;
  if (count_ > 0) nth(count_ - 1).to = std::min(nth(count_ - 1).to, plan_start);
  const Stamp end = plan_start + validity;
  Stamp from = plan_start;
  for (const ThrustRates& rate : rates) {
    if (from >= end) break;
    if (count_ == kCapacity) {
      first_ = (first_ + 1) % kCapacity;
      --count_;
    }
    Piece& piece = nth(count_++);
    piece.from = from;
    piece.to = std::min(from + step, end);
    piece.rates = rate;
    from = piece.to;
  }
}

void InputTimeline::begin_at(Stamp from) noexcept {
  while (count_ > 0 && nth(0).to <= from) {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  if (count_ > 0) nth(0).from = std::max(nth(0).from, from);
}

std::vector<InputTimeline::Piece> InputTimeline::pieces(Stamp from) const {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < count_; ++i)
    if (nth(i).to > from) pieces.push_back(nth(i));
  return pieces;
}

bool InputTimeline::restore(std::span<const Piece> pieces) noexcept {
  if (pieces.size() > kCapacity) return false;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (pieces[i].from >= pieces[i].to || (i > 0 && pieces[i].from < pieces[i - 1].to)) return false;
  first_ = 0;
  count_ = pieces.size();
  std::copy(pieces.begin(), pieces.end(), ring_.begin());
  return true;
}

void predict(const QuadrotorModel& model, const InputTimeline& inputs, Stamp from, Stamp to,
             const Eigen::Vector3d& disturbance_W_m_s2, QuadrotorState* state) noexcept {
  inputs.visit(from, to, [&](const ThrustRates& rates, Stamp begin, Stamp end) {
    while (begin < end) {
      const Stamp dt = std::min<Stamp>(end - begin, kLongestStep);
      const double dt_s = seconds(dt);
      *state = step_reference(model, *state, rates, dt_s);
      state->p_WB += 0.5 * dt_s * dt_s * disturbance_W_m_s2;
      state->v_WB += dt_s * disturbance_W_m_s2;
      begin += dt;
    }
  });
}

void predict_rotors(const QuadrotorModel& model, const InputTimeline& inputs, Stamp from, Stamp to,
                    QuadrotorState* state) noexcept {
  inputs.visit(from, to, [&](const ThrustRates& rates, Stamp begin, Stamp end) {
    step_rotors(model, rates, seconds(end - begin), state);
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
