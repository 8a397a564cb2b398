#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "client/firmware/mavlink/messages_state.h"
#include "client/flight/ports.h"
#include "common/base/clock.h"
#include "common/base/result.h"

namespace gatefield::bridge {

namespace mavlink = firmware::mavlink;

/// Where the autopilot's local frame lies in the world of the course: p_W = p_WL + R_z(yaw_WL) p_L, where L is the
/// local NED frame with its axes turned to ENU.
struct LocalFrame {
  Eigen::Vector3d p_WL = Eigen::Vector3d::Zero();
  double yaw_WL_rad = 0.0;
};

/// Which messages a state is made of.
enum class StateFrom : std::uint8_t {
  kAuto,           ///< ODOMETRY where it comes, else the two
  kOdometry,       ///< ODOMETRY alone
  kLocalPosition,  ///< LOCAL_POSITION_NED and ATTITUDE_QUATERNION
};

/// Why a message gave no state.
enum class NoState : std::uint8_t {
  kNone,
  kFrame,      ///< axes that are not understood, see Odometer
  kQuality,    ///< the estimator says that it has failed
  kNotPaired,  ///< the other of the two messages is missing or too old
  kNotRising,  ///< not newer than the last one
  kFuture,     ///< its stamp lies ahead of now
  kOld,        ///< its stamp lies too far back
};
inline constexpr std::size_t kNoStateKinds = 7;

struct OdometerOptions {
  StateFrom from = StateFrom::kAuto;
  LocalFrame frame;
  Stamp oldest{std::chrono::milliseconds(100)};  ///< a state that is older when it comes is refused; 5 ms to 1 s
};
Status validate(const OdometerOptions& options);

/// Makes states of the autopilot's messages: world ENU, body FLU, stamps of our clock.
///
/// ODOMETRY: pose in MAV_FRAME_LOCAL_NED or LOCAL_FRD (whose forward axis is taken for north), velocity in either of
/// them or in BODY_FRD, rates in the body. LOCAL_POSITION_NED and ATTITUDE_QUATERNION: each new one is paired with the
/// newest of the other kind, at most kPairGap apart; position is carried to the attitude's stamp by the velocity, or
/// the attitude to the position's by its rates.
///
/// A stamp more than kFuture ahead of now, or more than `oldest` behind, is wrong: clocks that do not agree, or a link
/// that holds messages back. How far off it was is kept for the sentence.
/// Thread-safe: no.   Real-time safe: yes.   Errors: none; what gives no state is counted by its reason.
class Odometer {
 public:
  static constexpr Stamp kPairGap{std::chrono::milliseconds(60)};
  static constexpr Stamp kFuture{std::chrono::milliseconds(10)};
  static constexpr Stamp kOdometryLost{std::chrono::milliseconds(500)};  ///< then kAuto takes the two again

  /// @pre validate(options)
  explicit Odometer(const OdometerOptions& options) noexcept : options_(options) {}

  /// @param stamp  of the message, in our time
  /// @pre the messages are without fault (mavlink::find_fault())
  NoState on_odometry(Stamp now, Stamp stamp, const mavlink::Odometry& message) noexcept;
  NoState on_position(Stamp now, Stamp stamp, const mavlink::LocalPositionNed& message) noexcept;
  NoState on_attitude(Stamp now, Stamp stamp, const mavlink::AttitudeQuaternion& message) noexcept;

  /// The newest state; empty: none yet.
  const std::optional<flight::TimedState>& newest() const noexcept { return state_; }
  /// The newest attitude, with or without a position.
  const std::optional<PlainQuaternion>& attitude() const noexcept { return attitude_; }

  std::uint64_t states() const noexcept { return states_; }
  std::uint64_t refused(NoState why) const noexcept { return refused_[static_cast<std::size_t>(why)]; }
  /// Now less stamp, of the last state and of the last one refused as kFuture or kOld.
  Stamp age() const noexcept { return age_; }
  Stamp wrong_age() const noexcept { return wrong_age_; }
  /// Jumps of the autopilot's estimate (its reset_counter), since the first state.
  std::uint64_t jumps() const noexcept { return jumps_; }

 private:
  NoState refuse(NoState why) noexcept;
  NoState take(Stamp now, Stamp stamp, const QuadrotorState& state_L) noexcept;
  NoState pair(Stamp now) noexcept;
  bool takes_pairs(Stamp now) const noexcept;

  struct Position {
    Stamp stamp{0};
    Eigen::Vector3d p_L, v_L;
  };
  struct Attitude {
    Stamp stamp{0};
    Eigen::Quaterniond q_LB;
    Eigen::Vector3d w_B;
  };

  OdometerOptions options_;
  std::optional<Position> position_;
  std::optional<Attitude> paired_attitude_;
  std::optional<PlainQuaternion> attitude_;
  std::optional<flight::TimedState> state_;
  std::optional<Stamp> odometry_at_;
  std::optional<std::uint8_t> reset_counter_;
  std::uint64_t states_ = 0, jumps_ = 0;
  std::array<std::uint64_t, kNoStateKinds> refused_{};
  Stamp age_{0}, wrong_age_{0};
};

/// What keeps states from coming, in words with the next step.
Error describe(NoState why, Stamp wrong_age, const OdometerOptions& options);

}  // namespace gatefield::bridge
