#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/config/hard_world.h"

namespace gatefield::simulator {

/// When the camera takes frames, how the body moves meanwhile, and when a frame is out.
///
/// The first frame is taken at the first step, the others a period apart; each is exposed around its own time and out a
/// delay later (not before its exposure is over). Its stamp is the middle of the exposure, but for an error whose sign
/// the seed draws. Without errors a frame is one pose, out at once.
/// Thread-safe: no.   Real-time safe: yes, but for the constructor.
class Shutter {
 public:
  static constexpr std::size_t kPoses = 5;  ///< over an exposure, evenly from its begin to its end

  struct Frame {
    Stamp stamp{0};
    std::array<Eigen::Isometry3d, kPoses> X_WB;
    std::size_t count = 1;  ///< of poses: 1 or kPoses

    std::span<const Eigen::Isometry3d> poses() const noexcept { return {X_WB.data(), count}; }
    const Eigen::Isometry3d& middle() const noexcept { return X_WB[count / 2]; }
  };

  Shutter(const config::CameraErrors& camera, Stamp period, std::uint64_t seed);

  /// Once a step. @return a frame that is out now
  std::optional<Frame> step(Stamp now, const Eigen::Isometry3d& X_WB) noexcept;

 private:
  struct Past {
    Stamp stamp{0};
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  };
  const Eigen::Isometry3d& pose_at(Stamp stamp) const noexcept;

  Stamp period_, exposure_, out_after_, stamp_error_;
  std::vector<Past> past_;  ///< cyclic, newest at newest_
  std::size_t newest_ = 0;
  bool begun_ = false;
  Stamp next_{0};             ///< frame to be taken
  std::vector<Stamp> taken_;  ///< cyclic: frames that are not out yet
  std::size_t first_ = 0, waiting_ = 0;
};

}  // namespace gatefield::simulator
