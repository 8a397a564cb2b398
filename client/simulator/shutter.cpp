#include "client/simulator/shutter.h"

#include <algorithm>

#include "client/simulator/plant.h"
#include "common/base/random.h"

namespace gatefield::simulator {

Shutter::Shutter(const config::CameraErrors& camera, Stamp period, std::uint64_t seed)
    : period_(period),
      exposure_(camera.exposure),
      out_after_(std::max(camera.delay, camera.exposure / 2)),
      stamp_error_(camera.stamp_error),
      past_(static_cast<std::size_t>((out_after_ + camera.exposure / 2) / Plant::kStep) + 2),
      taken_(static_cast<std::size_t>(out_after_ / period) + 2) {
  Random random(seed, Stream("gatefield.stamps"));
  if (random.chance(0.5)) stamp_error_ = -stamp_error_;
}

std::optional<Shutter::Frame> Shutter::step(Stamp now, const Eigen::Isometry3d& X_WB) noexcept {
  if (!begun_) {
    std::fill(past_.begin(), past_.end(), Past{now, X_WB});
    next_ = now;
    begun_ = true;
  }
  newest_ = (newest_ + 1) % past_.size();
  past_[newest_] = {now, X_WB};
  if (now >= next_) {
    if (waiting_ < taken_.size()) taken_[(first_ + waiting_++) % taken_.size()] = now;
    next_ = std::max(next_ + period_, now);  // frames that a slip took are not made up for
  }
  if (waiting_ == 0 || now < taken_[first_] + out_after_) return std::nullopt;
  const Stamp middle = taken_[first_];
  first_ = (first_ + 1) % taken_.size();
  --waiting_;

  Frame frame;
  frame.stamp = middle + stamp_error_;
  frame.count = exposure_ > Stamp{0} ? kPoses : 1;
  for (std::size_t i = 0; i < frame.count; ++i) {
    const double share = frame.count > 1 ? static_cast<double>(i) / (kPoses - 1) - 0.5 : 0.0;
    frame.X_WB[i] = pose_at(middle + from_seconds(share * seconds(exposure_)));
  }
  return frame;
}

/// The nearest one in time.
const Eigen::Isometry3d& Shutter::pose_at(Stamp stamp) const noexcept {
  const Past* nearest = &past_[newest_];
  for (const Past& past : past_)
    if (std::chrono::abs(past.stamp - stamp) < std::chrono::abs(nearest->stamp - stamp)) nearest = &past;
  return nearest->X_WB;
}

}  // namespace gatefield::simulator
