#include "server/pilot/thrust_factor.h"

#include <algorithm>
#include <cmath>

namespace gatefield::pilot {

void ThrustFactor::observe(const Eigen::Vector3d& missed_W_m_s, const Eigen::Vector3d& z_W, double push_m_s,
                           Stamp dt) noexcept {
  const double dt_s = seconds(dt);
  if (dt <= Stamp{0} || !missed_W_m_s.allFinite() || !(push_m_s >= kLeastThrust * kGravity_m_s2 * dt_s)) return;
  const double correction = std::clamp(z_W.dot(missed_W_m_s) / push_m_s, -kMaxCorrection, kMaxCorrection);
  factor_ = std::clamp(factor_ + (1.0 - std::exp(-dt_s / kTime_s)) * correction, kLow, kHigh);
  observed_ = std::min(observed_ + dt, kWarmUp);
}

void ThrustFactor::observe(const QuadrotorState& begin, const QuadrotorState& predicted, const Eigen::Vector3d& v_WB,
                           double mass_kg, Stamp dt) noexcept {
  const double thrust_n = 0.5 * (begin.thrust_n.sum() + predicted.thrust_n.sum());
  observe(v_WB - predicted.v_WB, thrust_axis_W(begin, predicted), seconds(dt) * thrust_n / mass_kg, dt);
}

Eigen::Vector3d thrust_axis_W(const QuadrotorState& begin, const QuadrotorState& end) noexcept {
  return (begin.q_WB * Eigen::Vector3d::UnitZ() + end.q_WB * Eigen::Vector3d::UnitZ()).normalized();
}

bool ThrustFactor::unlike_told() const noexcept { return known() && std::abs(factor_ - 1.0) > kUnlike; }

void ThrustFactor::restore(const State& state) noexcept {
  factor_ = std::isfinite(state.factor) ? std::clamp(state.factor, kLow, kHigh) : 1.0;
  observed_ = std::clamp(state.observed, Stamp{0}, kWarmUp);
}

}  // namespace gatefield::pilot
