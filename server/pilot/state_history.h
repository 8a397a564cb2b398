#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <vector>

#include "common/base/clock.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// Where the vehicle was lately, so that a depth frame can be bound to the pose at its capture.
///
/// Between two states the position is the cubic Hermite curve through both positions and velocities and the attitude a
/// slerp; past the newest state the pose goes on with its velocity and body rates for at most kMaxExtrapolation (at
/// 20 m/s^2 that errs by 9 mm). All stamps are of the client's clock.
/// Thread-safe: yes, by a mutex held for microseconds; shared by the receiving thread and perception, never taken by
/// the control step.   Real-time safe: no (mutex); no allocation after construction.
class StateHistory {
 public:
  static constexpr std::chrono::nanoseconds kMaxExtrapolation = std::chrono::milliseconds(30);
  /// Two neighbouring states farther apart than this say nothing about what was between them.
  static constexpr std::chrono::nanoseconds kMaxGap = std::chrono::milliseconds(250);

  /// @param capacity  states kept, at least 2: one second at the fastest rate that is expected
  explicit StateHistory(std::size_t capacity = 1024);

  /// Where the vehicle was at one moment.
  struct Entry {
    Stamp stamp{0};
    Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
    Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  };

  /// @pre stamps rise from call to call, but for begin_line() between them
  void add(Stamp stamp, const QuadrotorState& state) noexcept;
  /// The stamps to come have nothing to do with those that came: forgets all states.
  /// @param line  number of the time line that begins; 0 is the first one's
  void begin_line(std::uint32_t line) noexcept;

  enum class Found {
    kYes,
    kEmpty,   ///< no state came yet
    kTooOld,  ///< captured before the oldest state that is kept
    kTooNew,  ///< captured more than kMaxExtrapolation after the newest state
    kGap,     ///< captured between two states more than kMaxGap apart
  };
  /// @param X_WB  out, only when found: pose of the body at `stamp`
  /// @param off   out, may be null: how far the stamp lies outside of what is kept (too old, too new), or the gap
  /// @param line  out, may be null: number of the time line that the stamp was taken to be of
  Found pose_at(Stamp stamp, Eigen::Isometry3d* X_WB, std::chrono::nanoseconds* off = nullptr,
                std::uint32_t* line = nullptr) const noexcept;

  /// What pose_at() needs for stamps after `from`, at most the newest `count` entries: to be written down. Allocates.
  std::vector<Entry> entries(Stamp from, std::size_t count) const;
  /// @pre stamps rise, unit quaternions
  void restore(const std::vector<Entry>& entries, std::uint32_t line) noexcept;

 private:
  const Entry& nth(std::size_t index) const noexcept { return ring_[(first_ + index) % ring_.size()]; }

  mutable std::mutex mutex_;
  std::vector<Entry> ring_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::uint32_t line_ = 0;
};

}  // namespace gatefield::pilot
