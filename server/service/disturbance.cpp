#include "server/service/disturbance.h"

#include <cmath>

namespace gatefield::service {
namespace {

Eigen::Vector3d bounded(const Eigen::Vector3d& v, double most) noexcept {
  const double size = v.norm();
  return size > most ? Eigen::Vector3d(v * (most / size)) : v;
}

}  // namespace

void Disturbance::observe(const Eigen::Vector3d& missed_W_m_s, Stamp dt) noexcept {
  if (!wanted() || dt <= Stamp{0} || dt > kLongestGap || !missed_W_m_s.allFinite()) return;
  const double dt_s = seconds(dt);
  const Eigen::Vector3d residual_W = bounded(missed_W_m_s / dt_s, kMostResidual_m_s2);
  acceleration_W_ =
      bounded(acceleration_W_ + (1.0 - std::exp(-dt_s / time_s_)) * (residual_W - acceleration_W_), kMost_m_s2);
}

}  // namespace gatefield::service
