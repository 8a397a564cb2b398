#pragma once

namespace gatefield::planner {

/// cost[m] += weight max(0, |(x, y, z)[m]| - limit)^2: the shape of every soft limit on a vector's length.
/// Thread-safe: yes.   Real-time safe: yes.
void accumulate_excess(float weight, float limit, const float* x, const float* y, const float* z, int count,
                       float* cost) noexcept;

}  // namespace gatefield::planner
