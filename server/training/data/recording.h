#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/gate.h"

/// A recording as its folder has it (import.h says what lies there), read and checked. Not for use outside of this
/// folder. Thread-safe: yes.
namespace gatefield::training {

struct RecordedCamera {
  CameraModel model;
  double unit_m = 0.001;  ///< a grey level
};

struct RecordedGate {
  Eigen::Isometry3d X_WG;
  GateShape shape;
};

struct RecordedFrame {
  std::filesystem::path image;
  std::size_t line = 0;  ///< of poses.csv, for messages
  double time_s = 0.0;
  Eigen::Isometry3d X_WC;
};

struct Recording {
  std::filesystem::path folder;
  RecordedCamera camera;
  std::vector<RecordedGate> gates;
  std::vector<RecordedFrame> frames;
};

/// Reads all but the images, which have to be there. Errors: file, line, value and what was expected.
Result<Recording> read_recording(const std::filesystem::path& folder);

/// camera.txt (import.h). Errors: file, line, value and what was expected.
Result<RecordedCamera> read_camera(const std::filesystem::path& file);

/// z-depth in metres, row-major, whatever the camera's range; 0 = no return.
/// Errors: no 16-bit grey PNG, another size than the camera's.
Result<std::vector<float>> read_depth_png(const std::filesystem::path& file, const RecordedCamera& camera);

/// What lies outside of the camera's range is 0.
void cut_to_range(const CameraModel& camera, std::vector<float>* depth_m);

/// z-depth in metres, row-major in the recording's camera; 0 where there is none or outside of its range.
/// Errors: no 16-bit grey PNG, another size than camera.txt's.
Result<std::vector<float>> read_depth(const Recording& recording, const RecordedFrame& frame);

/// "<file> line <line>: <what>"
Error at_line(const std::filesystem::path& file, std::size_t line, const std::string& what);

}  // namespace gatefield::training
