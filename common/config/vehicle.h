#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/geometry/camera.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::config {

struct Vehicle {
  std::string title;
  QuadrotorModel quadrotor;
  CameraModel camera;
};

/// Reads a vehicle file (schema: vehicle.proto) and checks it. The sentence names file, field, value and what was
/// expected. Thread-safe: yes.   Real-time safe: no.
Result<Vehicle> load_vehicle(const std::filesystem::path& file);

}  // namespace gatefield::config
