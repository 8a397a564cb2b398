#pragma once

#include <filesystem>
#include <string>

#include "client/simulator/run_log.h"
#include "common/config/scenario.h"

namespace gatefield::simulator {

/// A picture of a flight, 1800 x 1000: top view and side view to scale with the true gates, the nominal waypoints and
/// the path coloured by speed, and speed over time with the gates marked.
/// @param subtitle  smaller, under the result: seed, vehicle, planner
/// Errors: the file can't be written (its name and why).
Status write_flight_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                            const std::string& subtitle);

}  // namespace gatefield::simulator
