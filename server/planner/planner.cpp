#include "server/planner/planner.h"

#include <algorithm>
#include <string>

#include "common/base/text.h"

namespace gatefield::planner {

Status check_heights(const Profile& profile, const QuadrotorModel& model, const Course& course) {
  if (!(profile.altitude_weight > 0)) return {};
  const double reference_m = height_reference_m(course);
  const double lowest_m = reference_m + profile.altitude_min_m, highest_m = reference_m + profile.altitude_max_m;
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    const Waypoint& waypoint = course.waypoints[i];
    const double room_m = std::max(0.0, waypoint.gate.inner_half_m - model.collision_radius_m);
    const double z_m = waypoint.p_W.z();
    if (z_m + room_m >= lowest_m && z_m - room_m <= highest_m) continue;
    return Error::invalid("course.waypoints[" + std::to_string(i) + "].p_W", text(waypoint.p_W) + " m",
                          "z from " + text(lowest_m - room_m) + " to " + text(highest_m + room_m) +
                              " m, so that the vehicle passes between the " + text(profile.altitude_min_m) + " and " +
                              text(profile.altitude_max_m) + " m that profile " + profile.name + " permits above " +
                              (course.floor_z_m ? "the floor" : "1.5 m below the lowest gate") + " (" +
                              text(reference_m) + " m)");
  }
  return {};
}

}  // namespace gatefield::planner
