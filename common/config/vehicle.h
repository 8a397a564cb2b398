#pragma once

#include <filesystem>
#include <map>
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
  double propeller_radius_m = 0.061;  ///< from axis to tip
  Actuation actuation;
  CameraModel camera;
  std::vector<std::string> notes;  ///< what was taken otherwise than written, for the person whose file it is
};

/// How the vehicle is driven when it is by `kind`: as its file says; where the file says the other kind and has no
/// lags, with those of a flight controller that is tuned to the vehicle's rotors as usual, tau_r their time constant:
/// thrust tau_r, rates about x and y 1.7 tau_r, about z 3.2 tau_r (there the rotors have the least to turn with).
Actuation driven_by(const Vehicle& vehicle, Actuation::Kind kind);

/// The kinds as command lines name them: "rotor-thrusts", "body-rates".
const std::map<std::string, Actuation::Kind>& actuation_names();

/// The propellers' radius where a vehicle file says none: kUsualPropeller of half the shortest way between two rotors.
/// (Racers with 5-inch propellers have 0.8 to 0.85 of it.)
double usual_propeller_radius_m(const QuadrotorModel& model);
inline constexpr double kUsualPropeller = 0.8;

class ActuationSpec;  // of vehicle.proto

/// Unchecked: validate(Actuation).
Actuation to_actuation(const ActuationSpec& spec);

/// Reads a vehicle file (schema: vehicle.proto) and checks it. Moments of inertia that contradict each other by
/// rounding are mended, with a note (mend_inertia()). Errors: as load_text(); kInvalid with the field
/// ("quadrotor.mass_kg", "camera.cx_px"), and a sentence that names file, field, value and what was expected.
/// Thread-safe: yes.   Real-time safe: no.
Result<Vehicle> load_vehicle(const std::filesystem::path& file);

}  // namespace gatefield::config
