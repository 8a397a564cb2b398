#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/clock.h"
#include "common/geometry/camera.h"
#include "common/protocol/problems.h"
#include "server/gates/gate_records.h"
#include "server/gates/passages.h"
#include "server/perception/depth_image.h"
#include "server/perception/gate_sensor.h"

namespace gatefield::perception {

/// What was made of one depth frame, for SensorWatch.
struct WatchedFrame {
  WireImage image;
  DecodedDepth decoded;  ///< in the unit as told
  Stamp capture{0};
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();  ///< pose of the camera, with the mounting as told
  std::uint32_t target = 0;                                ///< waypoint that is looked for
  bool expected = false;  ///< its gate should be in view, and was not taken from this frame or an earlier one
  bool taken = false;     ///< a gate of the course was taken from this frame
  /// Where the image as it is shows the sensor a gate when it looks for the target's, taken or not; world frame with
  /// the mounting as told.
  std::optional<Eigen::Vector3d> seen_W{};
};

/// Finds out from the images whether depths are in another unit than was told, or the camera is mounted otherwise.
/// Lengths are those of the usual gate (gates::gate_size()): where the target is of another size, times that.
///
/// A gate that should be in view is not seen. A mistake explains it when
///   - corrected, a frame shows the sensor a gate within `tolerance_m` of where the target's waypoint is,
///   - uncorrected, the same gate is farther than that, and twice as far as when corrected, from every waypoint, and
///   - two tries in a row find the same correction and, within kSamePlace_m, the same place.
/// Corrections of the unit: depths times 0.001, 0.01, 0.1, 0.2, 0.25, 0.5, 2, 4, 5, 10, 100, 1000. Corrections of the
/// mounting: half or quarter turns about the optical axis, half a turn about the body's z axis (then the gate may be
/// any of the course's, since the target is behind the camera). A gate of another size than the course says, one that
/// stands within the tolerance of its waypoint, and another gate of the course give no problem: uncorrected, they are
/// near a waypoint. Where a mistake moves the gate by less than the tolerance (a factor of 2 nearer than 3.6 m), it is
/// not found.
///
/// A gate is seen, but does not stand still. With a wrong mounting it moves through the world as the vehicle turns
/// (that it may lie near its waypoint now and then is why it is taken). Over the sightings of the last kWindow, with
/// spread = the distance from the median place within which three of four lie (so that the few since the vehicle began
/// to turn count, and a few of another gate don't), a turn of the mounting explains it when for kMoving
///   spread as told > kMoved_m   and   spread turned < kStill spread as told.
///
/// Float depths are millimetres: nearly all, and not all the same, are beyond the camera's range for kFloats and within
/// it when they are taken for millimetres. This one needs no sensor.
///
/// Cost: while gates are seen, some arithmetic on at most 64 points a frame. While one is missing: every kBetween at
/// most, one pass over the pixels and one look of the sensor (the learned one's 2 to 4 ms); which correction is looked
/// at follows from how many pixels around the waypoint would come to lie at its distance, and those without any are
/// left out.
/// Thread-safe: no (perception).   Real-time safe: no (sensors allocate).
class SensorWatch {
 public:
  static constexpr int kMissedFrames = 3;                            ///< in a row, and
  static constexpr Stamp kMissed = std::chrono::milliseconds(100);   ///< so long, before the first try
  static constexpr Stamp kBetween = std::chrono::milliseconds(400);  ///< tries
  static constexpr Stamp kAgree = std::chrono::seconds(2);           ///< an older try has nothing to agree with
  static constexpr Stamp kFloats = std::chrono::milliseconds(500);
  static constexpr double kSamePlace_m = 0.7;
  static constexpr Stamp kWindow = std::chrono::milliseconds(800);
  static constexpr Stamp kMoving = std::chrono::milliseconds(150);
  static constexpr double kMoved_m = 0.3;
  static constexpr double kStill = 0.3;
  static constexpr Stamp kCleared = std::chrono::seconds(1);

  /// @param passages  of the session's course; outlives this
  SensorWatch(const CameraModel& camera, const gates::Passages* passages, double tolerance_m);

  /// Takes in what was made of a frame, and may look at it once more: what the sensor's field() goes with is another
  /// observation then. A sensor that throws sees nothing. Captures that go back begin the waits anew.
  void watch(const WatchedFrame& frame, const gates::Expectation& gate, GateSensor* sensor);

  /// Problem::kDepthUnitLooksWrong, Problem::kMountingLooksWrong, both or none; until gates were taken for kCleared
  /// without a contradiction.
  protocol::Problems problems() const noexcept { return explained_ | floats_; }

 private:
  /// What would set the images right.
  struct Correction {
    enum class Kind { kUnit, kTurned } kind = Kind::kUnit;
    std::size_t which = 0;  ///< factor or turn
    bool operator==(const Correction&) const = default;
  };
  static const Correction kUpsideDown;
  struct Try {
    Correction correction;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< the gate, corrected
    Stamp capture{0};
  };

  void watch_floats(const WatchedFrame& frame);
  /// Whether the target's sightings stand still under a turn of the mounting, and not as told.
  void watch_sightings(const WatchedFrame& frame);
  double spread_m(const Eigen::Isometry3d& X_BC) const;
  /// Reads turns of the mounting from the gate that the sensor saw elsewhere.
  std::optional<Try> try_turns(const WatchedFrame& frame) const;
  /// Looks at the image as a correction makes it.
  std::optional<Try> try_looking(const WatchedFrame& frame, const gates::Expectation& gate, GateSensor* sensor);
  /// The likeliest correction; another likely one after each failure. Empty: there is none worth a look.
  std::optional<Correction> choose(const WatchedFrame& frame, const gates::Expectation& gate) const;
  void conclude(const Try& found) noexcept;
  /// Whether a gate that is `off_m` from a waypoint, corrected, and at p_W, uncorrected, speaks for the correction.
  bool explains(double off_m, const Eigen::Vector3d& p_W) const noexcept;
  double size() const noexcept;  ///< of the target
  double distance_to_course_m(const Eigen::Vector3d& p_W) const noexcept;
  double distance_to_waypoint_m(const Eigen::Vector3d& p_W, std::uint32_t waypoint) const noexcept {
    return (p_W - passages_->nominal(waypoint).center_W).norm();
  }

  CameraModel camera_;
  CameraModel reversed_camera_;  ///< of the image with its pixels in the opposite order
  const gates::Passages* passages_;
  double tolerance_m_;
  protocol::Problems explained_ = 0;
  protocol::Problems floats_ = 0;
  Stamp newest_{-1};
  Stamp floats_since_{-1};  ///< -1: the newest frame's are not so
  std::uint32_t target_ = 0;
  int missed_ = 0;  ///< frames in a row
  Stamp missed_since_{0};
  Stamp tried_{-1};
  std::size_t failures_ = 0;
  std::optional<Try> suspicion_;
  struct Sighting {
    Stamp capture{0};
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    Eigen::Vector3d p_C = Eigen::Vector3d::Zero();
  };
  std::vector<Sighting> sightings_;         ///< of the target, the oldest first
  std::optional<std::size_t> moving_turn_;  ///< that they stand still under, now,
  Stamp moving_since_{0};                   ///< and since when
  Stamp taken_since_{-1};                   ///< without a contradiction; -1: none was taken from the newest frame
  std::vector<float> depth_m_;
};

}  // namespace gatefield::perception
