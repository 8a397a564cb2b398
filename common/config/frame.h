#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/gate.h"

namespace gatefield::config {

/// A depth frame kept on disk: a text file (schema: frame.proto) and a 16-bit PNG in millimetres beside it.
struct SavedFrame {
  std::filesystem::path depth_file;  ///< as written in the text; absolute or relative to it
  CameraModel camera;                ///< X_BC and rate_hz mean nothing here
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  struct TrueGate {
    Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
    GateShape shape;
  };
  std::optional<TrueGate> gate;  ///< the truth, for drawing beside what was learned; never for planning
  double time_s = 0.0;
};

/// Reads the text; `depth_file` comes back as a path that can be opened.
/// Errors: as load_text(); kInvalid with the field, and a sentence that names file, field, value and what was expected.
/// Thread-safe: yes.   Real-time safe: no.
Result<SavedFrame> load_frame(const std::filesystem::path& file);

/// The text of a frame, as load_frame() takes it.
std::string frame_text(const SavedFrame& frame);

}  // namespace gatefield::config
