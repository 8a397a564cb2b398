#include "server/gates/passages.h"

namespace gatefield::gates {

Passages::Passages(const Course& course) : gates_(static_cast<std::uint32_t>(gate_count(course))) {
  std::vector<Eigen::Vector3d> own_W(gates_, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < course.waypoints.size(); ++i) {
    GateBelief nominal;
    nominal.center_W = course.waypoints[i].p_W;
    nominal.axis_W = passing_direction(course, i);
    nominal.shape = course.waypoints[i].gate;
    const std::size_t gate = gate_index(course, i);
    if (own_W[gate].isZero(0.0)) own_W[gate] = nominal.axis_W;
    gate_.push_back(static_cast<std::uint32_t>(gate));
    against_.push_back(nominal.axis_W.dot(own_W[gate]) < 0.0);
    nominal_.push_back(nominal);
  }
}

}  // namespace gatefield::gates
