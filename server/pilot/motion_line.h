#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "common/base/clock.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::pilot {

/// How one vehicle moves, by the states that it tells: what the speeds explain is taken, and one state elsewhere - a
/// position behind the next gate, a vehicle upside down, out of a wrong message or an estimator's lapse - is left out.
/// When kAgree states in a row go on from each other elsewhere, the motion is taken up there: the estimator found
/// another place, the vehicle hit something, or the first state of all was the bad one.
///
/// A state goes on from another, dt later, when
///   |p_1 - p_0 - dt (v_0 + v_1) / 2|  <=  kPosition_m + T (2 v + kSlip_m_s)          v = max(|v_0|, |v_1|)
///   |v_1 - v_0|                       <=  kVelocity_m_s + T kAcceleration_m_s2
///   angle between q_0 exp(dt (w_0 + w_1) / 2) and q_1  <=  kAngle_rad + T (2 w + kTurn_rad_s)    w = max(|w_0|, |w_1|)
/// with T = dt, but no longer than kLongest and what passed meanwhile by the receiver's clock: a stamp far ahead makes
/// no room for a position far ahead. Bounds are wide enough for velocities and rates in the wrong frame or unit, which
/// StateWatch then names, and far beyond an estimator's noise and corrections.
/// Thread-safe: no (the owner's lock).   Real-time safe: yes.
class MotionLine {
 public:
  static constexpr double kPosition_m = 1.0, kSlip_m_s = 5.0;
  static constexpr double kVelocity_m_s = 5.0, kAcceleration_m_s2 = 100.0;
  static constexpr double kAngle_rad = 1.0, kTurn_rad_s = 10.0;
  static constexpr Stamp kLongest = std::chrono::milliseconds(250);
  static constexpr int kAgree = 3;

  enum class Verdict {
    kNext,     ///< goes on from the newest one, or is the first of all
    kOff,      ///< lies elsewhere: not to be used
    kNewLine,  ///< the last of kAgree that lie elsewhere: the motion goes on from here
  };
  struct Judgement {
    Verdict verdict = Verdict::kNext;
    const char* field = nullptr;  ///< what the speeds don't explain ("p_WB"); null: kNext
  };

  /// @param stamp     later than that of the newest that was taken
  /// @param received  receiver's clock; it says nothing of a lockstep client (`free`)
  /// @pre finite numbers, attitude of (nearly) unit length
  Judgement judge(Stamp stamp, Stamp received, const QuadrotorState& state, bool free) noexcept;

  /// The stamps to come have nothing to do with those that came: the next state is taken.
  void begin_anew() noexcept { state_.begun = false; }
  /// How often the motion was taken up elsewhere.
  std::uint32_t jumps() const noexcept { return state_.jumps; }

  struct Point {
    Stamp stamp{0};
    Stamp received{0};
    Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_WB = Eigen::Vector3d::Zero();
    Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  };
  /// All there is: to be written down, and set to what was.
  struct State {
    bool begun = false;
    Point newest;             ///< that was taken
    Point elsewhere;          ///< the newest that lies elsewhere
    int agreeing = 0;         ///< how many in a row lie there
    std::uint32_t jumps = 0;  ///< how often the motion was taken up there
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) noexcept { state_ = state; }

 private:
  /// What of `to` the speeds don't explain; null: nothing.
  static const char* unexplained(const Point& from, const Point& to, bool free) noexcept;

  State state_;
};

}  // namespace gatefield::pilot
