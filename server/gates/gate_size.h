#pragma once

#include "common/geometry/gate.h"

namespace gatefield::gates {

/// How large a gate is against the usual one, whose opening is 1.0 m. Lengths that were chosen for that one and that
/// belong to the gate (how far off it may be believed, how near its plane is "near") are multiplied by it; what belongs
/// to the vehicle (its radius, its room to turn) is not.
/// Thread-safe: yes.   Real-time safe: yes.
inline double gate_size(const GateShape& shape) noexcept { return shape.inner_half_m / GateShape{}.inner_half_m; }

}  // namespace gatefield::gates
