#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::config {

struct Vehicle {
  std::string title;
  QuadrotorModel quadrotor;
  Actuation actuation;
  CameraModel camera;
  std::vector<std::string> notes;  ///< what was taken otherwise than written, for the person whose file it is
};

/// Reads a vehicle file (schema: vehicle.proto) and checks it. Moments of inertia that contradict each other by
/// rounding are mended, with a note (mend_inertia()). Errors: as load_text(); kInvalid with the field
/// ("quadrotor.mass_kg", "camera.cx_px"), and a sentence that names file, field, value and what was expected.
/// Thread-safe: yes.   Real-time safe: no.
Result<Vehicle> load_vehicle(const std::filesystem::path& file);

}  // namespace gatefield::config
