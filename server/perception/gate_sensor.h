#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "server/gates/gate_records.h"

namespace gatefield::perception {

/// A depth image, and where it was taken.
struct View {
  std::span<const float> depth_m;  ///< row-major z-depth, width * height of the camera; 0 = no return
  const CameraModel& camera;
  Eigen::Isometry3d X_WC;  ///< pose of the camera at the capture
};

/// Where a sensor looks for a gate.
enum class Where {
  kExpected,  ///< about where it is expected
  kAnywhere,  ///< in the whole image: the nearest gate in view
};

/// What one image says of one gate.
struct Observation {
  gates::GateMeasurement gate;  ///< pose and how far to trust it; either side may be the front
  double validity = 0.0;        ///< probability that a gate is there, at least what the sensor asks for
  /// Where the image alone places the gate, before any fit.
  Eigen::Vector3d glimpse_W = Eigen::Vector3d::Zero();
};

/// What a field can be made from anew, in another process: small enough to be written down.
struct FieldSource {
  /// Frame that the field is given in: the camera's for a decoder's (as it was corrected), the gate's for an hourglass.
  Eigen::Isometry3d X_WF = Eigen::Isometry3d::Identity();
  std::vector<float> latent;  ///< a decoder's condition; empty for fields without one
};

/// Finds gates in depth images. Each vehicle has one of its own, for the vehicle's whole session; gates are numbered as
/// the session's course has them. What a sensor needs beyond the image is its own matter: the learned one borrows
/// networks, the baselines' true poses come with the scenario.
/// Thread-safe: no (perception).   Real-time safe: no.
class GateSensor {
 public:
  virtual ~GateSensor() = default;

  /// False: an expectation can't steer it, it looks at the whole image always.
  virtual bool steerable() const noexcept = 0;

  /// Looks for the gate. @return empty: no gate is seen there. May throw what its libraries throw,
  /// or words of its own: it could not look, which is the server's fault and told as that (ErrorCode::kUnsupported).
  virtual std::optional<Observation> look(const View& view, const gates::Expectation& gate, Where where) = 0;

  /// The field that goes with the newest observation, moved with the gate: as measured it lies at `measured_X_WG` (the
  /// observation's pose, which gates::GateRecords may have turned round), and is believed at `X_WG`.
  /// @pre the last look() gave an observation of a gate of this shape
  virtual std::shared_ptr<const gates::Field> field(const Eigen::Isometry3d& measured_X_WG,
                                                    const Eigen::Isometry3d& X_WG, const GateShape& shape) = 0;

  /// What `field`, one of this sensor's, is made from.
  virtual FieldSource source_of(const gates::Field& field) const = 0;
  /// The field that a sensor of the same kind and model had made from it, the same bit for bit.
  /// Errors (kInvalid): it is not this kind of sensor's.
  virtual Result<std::shared_ptr<const gates::Field>> restore(const FieldSource& source, const GateShape& shape) = 0;
};

}  // namespace gatefield::perception
