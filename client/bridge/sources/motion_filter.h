#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>

#include "common/base/clock.h"

namespace gatefield::bridge::sources {

/// Velocity and body rates of poses, for sources that measure none: the slope of a line of least squares through the
/// poses of the last `window`, for position in the world's axes, for attitude in the body's (rotation vectors against
/// the newest attitude). With t_i the stamps and x_i what was measured, m their means:
///
///   v = sum (t_i - m_t) x_i / sum (t_i - m_t)^2
///
/// It is the mean velocity of the window, so it lags by half of it and knows nothing of what is quicker; noise of sigma
/// in position becomes sigma sqrt(12 / n^3) / dt in velocity for n poses dt apart (0.2 mm at 240 Hz over 30 ms: 10
/// mm/s).
/// Thread-safe: no.   Real-time safe: yes.
class MotionFilter {
 public:
  static constexpr std::size_t kMostPoses = 64;  ///< more in a window: the newest, and the lag is shorter
  static constexpr Stamp kLongestGap{std::chrono::milliseconds(100)};  ///< then it begins anew

  struct Motion {
    Eigen::Vector3d v_W, w_B;
    Stamp lag{0};  ///< how long ago it held on the mean
  };

  /// @pre window > 0
  explicit MotionFilter(Stamp window) noexcept : window_(window) {}

  /// @param stamp  more than the last one's
  /// @return empty: there are not yet three poses over half the window
  std::optional<Motion> take(Stamp stamp, const Eigen::Vector3d& p_W, const Eigen::Quaterniond& q_WB) noexcept;

 private:
  struct Pose {
    Stamp stamp{0};
    Eigen::Vector3d p_W;
    Eigen::Quaterniond q_WB;
  };
  const Pose& back(std::size_t i) const noexcept { return poses_[(newest_ + kMostPoses - i) % kMostPoses]; }

  const Stamp window_;
  std::array<Pose, kMostPoses> poses_{};
  std::size_t newest_ = 0, count_ = 0;
};

}  // namespace gatefield::bridge::sources
