#include "server/pilot/disturbance.h"

#include <cmath>

namespace gatefield::pilot {
namespace {

Eigen::Vector3d bounded(const Eigen::Vector3d& v, double max) noexcept {
  const double size = v.norm();
  return size > max ? Eigen::Vector3d(v * (max / size)) : v;
}

}  // namespace

void Disturbance::observe(const Eigen::Vector3d& missed_W_m_s, Stamp dt) noexcept {
  if (!wanted() || dt <= Stamp{0} || dt > kLongestGap || !missed_W_m_s.allFinite()) return;
  const double dt_s = seconds(dt);
  const Eigen::Vector3d residual_W = bounded(missed_W_m_s / dt_s, kMaxResidual_m_s2);
  acceleration_W_ =
      bounded(acceleration_W_ + (1.0 - std::exp(-dt_s / time_s_)) * (residual_W - acceleration_W_), kMax_m_s2);
}

}  // namespace gatefield::pilot
