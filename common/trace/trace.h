#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

/// What a planner believed at each of its steps, as a text file: written by servers that are asked for it, read by
/// those who hold it against the truth. Not part of the wire.
namespace gatefield::trace {

/// One of the paths that a step weighed, at the end of each interval, with the target's Gate-SDF there.
struct Rollout {
  std::vector<Eigen::Vector3d> p_W;
  std::vector<double> field_m;  ///< as many; NaN: there was no field
};

struct Step {
  Stamp stamp{0};                                 ///< vehicle's clock, of the state that was planned from
  std::uint32_t waypoint = 0;                     ///< the target, index into the course
  bool hold = false;                              ///< course done
  bool seen = false;                              ///< the target was; else centre and axis are the nominal ones
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  ///< the vehicle
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_W = Eigen::Vector3d::UnitX();
  double center_sigma_m = 0.0;
  double axis_sigma_rad = 0.0;
  double field_age_s = 0.0;
  double lowest_field_m = 0.0;    ///< along the plan
  std::vector<Rollout> rollouts;  ///< mostly empty
};

/// One step as lines of the file, each with its line end.
std::string to_text(const Step& step);

/// Reads a file of to_text() lines; an unfinished last line is not there.
/// Errors: kUnreadable, the file can't be read, or a line is not of this kind (file and line number).
Result<std::vector<Step>> read(const std::filesystem::path& file);

}  // namespace gatefield::trace
