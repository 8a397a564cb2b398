#pragma once

#include <filesystem>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"

namespace gatefield::tools {

/// A moment of a flight: velocity, attitude and body rates, and what the vehicle is asked for from then on.
struct RecordedState {
  Stamp stamp{0};
  QuadrotorState state;  ///< p_WB and the rotors' thrusts are not known
  RateCommand asked = RateCommand::Zero();
};

/// Reads the flight of a vehicle of body rates from a table with commas, as gatefield-sim --csv writes it. The first
/// line names the columns, which may stand in any order; others are left alone:
///   t_s                                    time, rising
///   vx_m_s vy_m_s vz_m_s                   velocity in W (ENU)
///   qw qx qy qz                            attitude, B (FLU) to W
///   wx_rad_s wy_rad_s wz_rad_s             body rates in B
///   collective_n                           thrust that is asked for, of all rotors together
///   wx_asked_rad_s wy_asked_rad_s wz_asked_rad_s  body rates that are asked for
/// What is asked for holds until the next line. Lines of one time count once, the first.
/// Errors, with file and line: kUnreadable for what is no such table; kInvalid for a value beyond what the wire takes,
/// a time that falls, or fewer than two lines.
/// Thread-safe: yes.   Real-time safe: no.
Result<std::vector<RecordedState>> read_recording(const std::filesystem::path& file);

}  // namespace gatefield::tools
