#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

/// How the true world is harder than the planner's idea of it. docs/hard-world.md has every size with its source.
namespace gatefield::config {

/// Parts of a harder world, numbered as scenario.proto has them.
enum class WorldPart {
  kEasy,
  kHard,  ///< all that follow but furniture
  kDrift,
  kJumps,
  kLag,
  kThrustUnknown,
  kSlowCamera,
  kExposure,
  kStamps,
  kMounting,
  kDrag,
  kInflow,
  kBattery,
  kGroundEffect,
  kFurniture,
};

/// As command lines name them: "hard", "drift", "ground-effect".
const std::map<std::string, WorldPart>& world_part_names();

/// Errors of the state estimate beyond StateNoise; each part is off while its sizes are 0.
struct EstimateErrors {
  double drift_m_s = 0.0;        ///< one sigma of the velocity's error per axis, which the position integrates
  double drift_yaw_rad_s = 0.0;  ///< one sigma of the rate at which the heading drifts
  double drift_tilt_rad = 0.0;   ///< one sigma of the tilt's error about each level axis
  double drift_s = 2.0;          ///< correlation time of the three
  double jumps_hz = 0.0;         ///< how often position and heading jump, on average
  double jump_m = 0.0;           ///< one sigma of a jump per axis
  double jump_yaw_rad = 0.0;     ///< one sigma of a jump of the heading
  Stamp lag{0};                  ///< how old the state is that is sent as new
};

/// What the camera is otherwise than told.
struct CameraErrors {
  Stamp delay{0};             ///< from the middle of the exposure to the frame's departure
  Stamp exposure{0};          ///< in whole milliseconds it is sampled; 0: an instant
  Stamp stamp_error{0};       ///< of the frames' stamps, early or late all flight long
  double mounting_rad = 0.0;  ///< turned by this about an axis that is drawn
};

/// What air and battery do that the planner's model does not have. Lengths are in the vehicle's longest arm, so that
/// they fit vehicles of any size.
struct AirErrors {
  double drag_area_level = 0.0;  ///< C_d A along x and y of B, in squares of the arm
  double drag_area_axial = 0.0;  ///< along z
  double advance_ratio = 0.0;    ///< J at which a rotor has no thrust left; 0: inflow costs no thrust
  double thrust_coefficient = 0.11;
  double rotor_diameter = 1.17;                ///< in arms
  double charge_low = 0.5, charge_high = 0.5;  ///< the battery's at the start: uniform between them
  double sag = 0.0;                            ///< share of the voltage that hovering costs; 0: no battery
  double hover_s = 600.0;                      ///< a full battery lasts for so long in hover
  bool ground_effect = false;

  bool any() const noexcept {
    return drag_area_level > 0 || drag_area_axial > 0 || advance_ratio > 0 || sag > 0 || ground_effect;
  }
};

struct HardWorld {
  std::vector<WorldPart> parts;  ///< as asked for
  EstimateErrors estimate;
  bool thrust_unknown = false;
  double camera_rate_hz = 0.0;  ///< in place of the vehicle's; 0: the vehicle's
  CameraErrors camera;
  AirErrors air;
  bool furniture = false;
};

class WorldSizesSpec;  // of scenario.proto

/// A world of these parts with these sizes. Errors: kInvalid with the field ("world_sizes.lag_ms"): a size out of its
/// range, or of a part that is not there.
Result<HardWorld> to_hard_world(const std::vector<WorldPart>& parts, const WorldSizesSpec& sizes);
/// The same with the standard sizes.
HardWorld hard_world(const std::vector<WorldPart>& parts);

/// "hard, furniture"; empty: an easy world.
std::string in_words(const std::vector<WorldPart>& parts);

}  // namespace gatefield::config
