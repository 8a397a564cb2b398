#pragma once

#include <span>
#include <string>

#include "common/protocol/identified_drive.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "server/tools/recording.h"

namespace gatefield::tools {

/// What a recording says of how a vehicle follows what it is asked for.
struct Identified {
  protocol::IdentifiedDrive drive;  ///< medians over the flight; 0: not known
  double flown_s = 0.0;             ///< without gaps
};

/// Runs a recording through what a server runs in flight (pilot::DriveWatch, pilot::ThrustFactor), from the vehicle as
/// it is told; twice where limits were found, so that the lags are held against what the vehicle takes of its command
/// from the beginning. Gaps of more than 0.1 s are left out.
/// @param told         of Kind::kBodyRates   @param asked_at_most_rad_s  about x, y, z of B, more than 0
/// Thread-safe: yes.   Real-time safe: no.
Identified identify(std::span<const RecordedState> recording, const QuadrotorModel& model, const Actuation& told,
                    const Eigen::Vector3d& asked_at_most_rad_s);

/// As lines for the vehicle's file (common/config/vehicle.proto), with a word on each that people have to know. What is
/// not known stays as told, and says so. Lags are those of a step, as the file wants them
/// (IdentifiedDrive::rate_time_constant_s over RateLags::kOfStep).
std::string vehicle_lines(const Identified& identified, const QuadrotorModel& model, const Actuation& told);

}  // namespace gatefield::tools
