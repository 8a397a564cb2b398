#include "server/pilot/state_history.h"

#include <algorithm>

namespace gatefield::pilot {
namespace {

Eigen::Quaterniond rotation_of(const Eigen::Vector3d& angle_B) noexcept {
  const double angle_rad = angle_B.norm();
  if (angle_rad < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, angle_B / angle_rad));
}

}  // namespace

StateHistory::StateHistory(std::size_t capacity) : ring_(std::max<std::size_t>(capacity, 2)) {}

void StateHistory::add(Stamp stamp, const QuadrotorState& state) noexcept {
  const std::lock_guard lock(mutex_);
  Entry& entry = ring_[(first_ + count_) % ring_.size()];
  if (count_ == ring_.size())
    first_ = (first_ + 1) % ring_.size();
  else
    ++count_;
  entry.stamp = stamp;
  entry.p_WB = state.p_WB;
  entry.v_WB = state.v_WB;
  entry.w_WB_B = state.w_WB_B;
  entry.q_WB = state.q_WB.normalized();
}

void StateHistory::begin_line(std::uint32_t line) noexcept {
  const std::lock_guard lock(mutex_);
  count_ = 0;
  line_ = line;
}

std::vector<StateHistory::Entry> StateHistory::entries(Stamp from, std::size_t count) const {
  const std::lock_guard lock(mutex_);
  std::size_t begin = count_ > count ? count_ - count : 0;
  while (begin + 1 < count_ && nth(begin + 1).stamp <= from) ++begin;
  std::vector<Entry> entries;
  for (std::size_t i = begin; i < count_; ++i) entries.push_back(nth(i));
  return entries;
}

void StateHistory::restore(const std::vector<Entry>& entries, std::uint32_t line) noexcept {
  const std::lock_guard lock(mutex_);
  line_ = line;
  first_ = 0;
  count_ = std::min(entries.size(), ring_.size());
  std::copy(entries.end() - static_cast<std::ptrdiff_t>(count_), entries.end(), ring_.begin());
}

StateHistory::Found StateHistory::pose_at(Stamp stamp, Eigen::Isometry3d* X_WB, std::chrono::nanoseconds* off,
                                          std::uint32_t* line) const noexcept {
  const auto report = [off](Found found, std::chrono::nanoseconds by) {
    if (off) *off = by;
    return found;
  };
  const std::lock_guard lock(mutex_);
  if (line) *line = line_;
  if (count_ == 0) return report(Found::kEmpty, Stamp{0});
  const Entry& oldest = nth(0);
  const Entry& newest = nth(count_ - 1);
  if (stamp < oldest.stamp) return report(Found::kTooOld, oldest.stamp - stamp);
  if (stamp > newest.stamp + kMaxExtrapolation) return report(Found::kTooNew, stamp - newest.stamp);

  Eigen::Vector3d p_WB;
  Eigen::Quaterniond q_WB;
  if (stamp >= newest.stamp) {
    const double dt_s = seconds(stamp - newest.stamp);
    p_WB = newest.p_WB + dt_s * newest.v_WB;
    q_WB = newest.q_WB * rotation_of(dt_s * newest.w_WB_B);
  } else {
    std::size_t low = 0;  // nth(low).stamp <= stamp < nth(high).stamp
    std::size_t high = count_ - 1;
    while (high - low > 1) {
      const std::size_t middle = low + (high - low) / 2;
      (nth(middle).stamp <= stamp ? low : high) = middle;
    }
    const Entry& a = nth(low);
    const Entry& b = nth(high);
    if (b.stamp - a.stamp > kMaxGap) return report(Found::kGap, b.stamp - a.stamp);
    const double span_s = seconds(b.stamp - a.stamp);
    const double x = seconds(stamp - a.stamp) / span_s;
    const double x2 = x * x;
    const double x3 = x2 * x;
    p_WB = (2 * x3 - 3 * x2 + 1) * a.p_WB + (x3 - 2 * x2 + x) * span_s * a.v_WB + (3 * x2 - 2 * x3) * b.p_WB +
           (x3 - x2) * span_s * b.v_WB;
    q_WB = a.q_WB.slerp(x, b.q_WB);
  }
  X_WB->setIdentity();
  X_WB->linear() = q_WB.normalized().toRotationMatrix();
  X_WB->translation() = p_WB;
  return report(Found::kYes, Stamp{0});
}

}  // namespace gatefield::pilot
