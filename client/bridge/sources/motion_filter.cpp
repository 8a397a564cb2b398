#include "client/bridge/sources/motion_filter.h"

#include <algorithm>

namespace gatefield::bridge::sources {
namespace {

/// Of the shorter way round.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& q) noexcept {
  const Eigen::AngleAxisd turn(q.w() < 0 ? Eigen::Quaterniond(-q.coeffs()) : q);
  return turn.angle() * turn.axis();
}

}  // namespace

std::optional<MotionFilter::Motion> MotionFilter::take(Stamp stamp, const Eigen::Vector3d& p_W,
                                                       const Eigen::Quaterniond& q_WB) noexcept {
  if (count_ > 0 && stamp - back(0).stamp > kLongestGap) count_ = 0;
  newest_ = (newest_ + 1) % kMostPoses;
  poses_[newest_] = {stamp, p_W, q_WB};
  count_ = std::min(count_ + 1, kMostPoses);
  while (stamp - back(count_ - 1).stamp > window_) --count_;
  const bool full = count_ == kMostPoses || 2 * (stamp - back(count_ - 1).stamp) >= window_;
  if (count_ < 3 || !full) return std::nullopt;

  // Times and places count from the newest pose, so that large ones lose no digits.
  double mean_s = 0.0;
  for (std::size_t i = 0; i < count_; ++i) mean_s += seconds(back(i).stamp - stamp) / static_cast<double>(count_);
  double spread = 0.0;
  Motion motion{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), from_seconds(-mean_s)};
  for (std::size_t i = 0; i < count_; ++i) {
    const double t_s = seconds(back(i).stamp - stamp) - mean_s;
    spread += t_s * t_s;
    motion.v_W += t_s * (back(i).p_W - p_W);
    motion.w_B += t_s * rotation_vector(q_WB.conjugate() * back(i).q_WB);
  }
  motion.v_W /= spread;
  motion.w_B /= spread;
  return motion;
}

}  // namespace gatefield::bridge::sources
