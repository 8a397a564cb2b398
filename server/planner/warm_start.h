#pragma once

#include <span>

#include "common/vehicle/quadrotor.h"

namespace gatefield::planner {

/// The previous plan seen from `elapsed` later: u'[k] = u(k dt + elapsed), linear between the plan's inputs, zero
/// beyond its end (thrusts stay as they are). elapsed <= 0 leaves it as it is. Thread-safe: yes.   Real-time safe: yes.
void shift_plan(double elapsed_s, double step_s, std::span<ThrustRates> inputs) noexcept;

}  // namespace gatefield::planner
