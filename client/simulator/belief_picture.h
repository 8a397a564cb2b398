#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/simulator/run_log.h"
#include "common/config/scenario.h"
#include "common/trace/trace.h"

/// Pictures of what a planner believed and weighed, beside what is true. Colours of field values: red where the
/// Gate-SDF says collision (<= 0), green where it says free. All are deterministic.
/// Errors: the file can't be written (its name and why).
namespace gatefield::simulator {

/// How a flight ended: the last second from above and from the side, with the gate that it ended at as it is (filled)
/// and as it was believed at each step (outlines, the later the darker).
/// @param trace  of the flight's planner, may be empty: then only the flight is drawn
/// @param waypoint  of the gate that it ended at, index; -1: none. The view is around where the flight ended
Status write_end_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                         const std::vector<trace::Step>& trace, int waypoint, const std::string& title,
                         const std::string& subtitle);

/// All rollouts of a flight's trace from above and from the side, coloured by their field value (paper, figure of the
/// spatial consistency).
Status write_rollouts_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                              const std::vector<trace::Step>& trace, const std::string& title,
                              const std::string& subtitle);

/// The approach to the first gate in four moments from left to right: the depth frame, and from above the rollouts that
/// were weighed then, coloured by their field value (paper, figure of the acute approach).
Status write_approach_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                              const std::vector<trace::Step>& trace, const std::string& title,
                              const std::string& subtitle);

}  // namespace gatefield::simulator
