#include "server/gates/known_gates.h"

#include <algorithm>

namespace gatefield::gates {

const RememberedGate* KnownGates::seen(std::uint32_t waypoint) const noexcept {
  if (!snapshot_) return nullptr;
  for (std::size_t i = 0; i < snapshot_->gates.size(); ++i)
    if (passages_->gate(snapshot_->waypoint[i]) == passages_->gate(waypoint))
      return snapshot_->gates[i].seen ? &snapshot_->gates[i] : nullptr;
  return nullptr;
}

GateBelief KnownGates::belief(std::uint32_t waypoint) const noexcept {
  GateBelief belief = passages_->nominal(waypoint);
  const RememberedGate* const gate = seen(waypoint);
  if (!gate) return belief;
  belief.center_W = gate->center_W;
  belief.axis_W = passages_->turned(waypoint, gate->axis_W);
  belief.seen = true;
  belief.center_sigma_m = gate->center_sigma_m;
  belief.axis_sigma_rad = gate->axis_sigma_rad;
  belief.field = gate->field.get();
  return belief;
}

double KnownGates::age_s(std::uint32_t waypoint, Stamp at) const noexcept {
  const RememberedGate* const gate = seen(waypoint);
  return gate ? std::max(0.0, seconds(at - gate->stamp)) : -1.0;
}

}  // namespace gatefield::gates
