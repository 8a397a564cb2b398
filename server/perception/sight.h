#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/clock.h"
#include "common/geometry/camera.h"
#include "common/protocol/messages.h"
#include "server/gates/gate_records.h"
#include "server/perception/depth_image.h"
#include "server/perception/gate_sensor.h"
#include "server/perception/sensor_watch.h"

namespace gatefield::perception {

/// Lengths are those of the usual gate (gates::gate_size()): of others, times their size.
struct SightOptions {
  double first_sight_distance_m = 12.0;    ///< look for a gate that was never seen within this distance
  double first_sight_tolerance_m = 1.8;    ///< a gate found anywhere, this near its waypoint, is that gate
  double view_margin_px_per_width = 0.15;  ///< expected centres this far outside the image are still looked for
};

/// The perception step of one vehicle: from a depth frame and the pose at its capture to what is remembered of the
/// gates. For the target and the gate after it, when it should be in view: look where it is expected; when that shows
/// nothing and the target was never seen, look anywhere, and take what is found only near the waypoint. What may be
/// wrong where a gate is not seen is SensorWatch's to find out, from the same frames; it changes nothing of what is
/// taken.
/// Thread-safe: no (perception).   Real-time safe: no (sensors allocate).
class Sight {
 public:
  Sight(const CameraModel& camera, const Course& course, std::unique_ptr<GateSensor> sensor,
        const SightOptions& options);
  Sight(const Sight&) = delete;
  Sight& operator=(const Sight&) = delete;

  enum class Outcome {
    kLooked,     ///< gates were looked for (and perhaps found)
    kEmpty,      ///< not one pixel has a return: the sensor is blind, covered or in the open
    kSaturated,  ///< every return is beyond the range or at the encoding's end: nothing to see
  };
  /// @param X_WB     pose of the body at the capture
  /// @param target   waypoint to pass now; @param next the one after it (the target itself when there is none)
  Outcome look(std::span<const std::uint8_t> pixels, protocol::DepthEncoding encoding, Stamp capture,
               const Eigen::Isometry3d& X_WB, std::uint32_t target, std::uint32_t next);

  const gates::GateRecords& records() const noexcept { return records_; }
  gates::GateRecords& records() noexcept { return records_; }
  GateSensor& sensor() noexcept { return *sensor_; }
  /// What the images contradict of what the session told.
  protocol::Problems problems() const noexcept { return watch_.problems(); }

 private:
  struct Search {
    bool taken = false;
    std::optional<Observation> seen;  ///< the newest one, taken or not
  };
  Search look_for(std::uint32_t waypoint, bool is_target, const View& view, Stamp capture);

  CameraModel camera_;
  std::unique_ptr<GateSensor> sensor_;
  SightOptions options_;
  gates::GateRecords records_;
  SensorWatch watch_;
  std::vector<float> depth_m_;
};

/// Takes what the sensor has just seen of a waypoint's gate into the records, and its field with it.
/// @return false: it was too far from the waypoint, or an outlier
bool remember(const Observation& seen, std::uint32_t waypoint, Stamp capture, GateSensor* sensor,
              gates::GateRecords* records);

}  // namespace gatefield::perception
