#include "server/service/known_gates.h"

#include <algorithm>

namespace gatefield::service {

const perception::RememberedGate* KnownGates::seen(std::uint32_t waypoint) const noexcept {
  if (!memory_) return nullptr;
  const perception::RememberedGate* gate = nullptr;
  if (memory_->target == waypoint)
    gate = &memory_->gates[0];
  else if ((memory_->target + 1) % waypoints_ == waypoint)
    gate = &memory_->gates[1];
  return gate && gate->seen ? gate : nullptr;
}

planner::GateBelief KnownGates::belief(std::uint32_t waypoint) const noexcept {
  const perception::RememberedGate* const gate = seen(waypoint);
  if (!gate) return course_->nominal(waypoint);
  planner::GateBelief belief;
  belief.center_W = gate->center_W;
  belief.axis_W = gate->axis_W;
  belief.seen = true;
  belief.center_sigma_m = gate->center_sigma_m;
  belief.axis_sigma_rad = gate->axis_sigma_rad;
  belief.field = &gate->field;
  return belief;
}

planner::GateBelief KnownGates::belief_at_nominal_center(std::uint32_t waypoint) const noexcept {
  planner::GateBelief gate = belief(waypoint);
  const Eigen::Vector3d nominal_W = course_->nominal(waypoint).center_W;
  gate.moved_W = nominal_W - gate.center_W;
  gate.center_W = nominal_W;
  return gate;
}

double KnownGates::age_s(std::uint32_t waypoint, Stamp at) const noexcept {
  const perception::RememberedGate* const gate = seen(waypoint);
  return gate ? std::max(0.0, seconds(at - gate->stamp)) : -1.0;
}

}  // namespace gatefield::service
