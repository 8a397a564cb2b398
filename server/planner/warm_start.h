#pragma once

#include <span>

#include "common/base/plain.h"

namespace gatefield::planner {

/// The previous plan seen from `elapsed` later: u'[k] = u(k dt + elapsed), linear between the plan's inputs, `beyond`
/// past
/// its end. elapsed <= 0 leaves it as it is. Thread-safe: yes.   Real-time safe: yes.
void shift_plan(double elapsed_s, double step_s, const PlainVector4& beyond, std::span<PlainVector4> inputs) noexcept;

}  // namespace gatefield::planner
