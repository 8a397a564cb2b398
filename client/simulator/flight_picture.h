#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/simulator/run_log.h"
#include "common/config/scenario.h"

namespace gatefield::simulator {

/// A picture of a flight, 1800 x 1000: top view and side view to scale with the true gates, the nominal waypoints and
/// the path coloured by speed, and speed over time with the gates marked.
/// @param subtitle  smaller, under the result: seed, vehicle, planner
/// Errors: the file can't be written (its name and why).
Status write_flight_picture(const std::filesystem::path& file, const config::Scenario& scenario, const Report& report,
                            const std::string& subtitle);

/// One of several flights over the same course.
struct FlownPath {
  struct Point {
    double t_s = 0.0;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    double speed_m_s = 0.0;
  };
  std::uint64_t seed = 1;  ///< of the true gates
  bool won = false;
  std::vector<Point> points;
};

/// A picture of several flights, 1800 x 1000: top view and side view with every flight's own gates (faint), the nominal
/// waypoints and all paths coloured by speed; lost ones end in a cross.
/// Errors: the file can't be written (its name and why).
Status write_flights_picture(const std::filesystem::path& file, const config::Scenario& scenario,
                             const std::vector<FlownPath>& flights, const std::string& title,
                             const std::string& subtitle);

}  // namespace gatefield::simulator
