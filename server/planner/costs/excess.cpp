#include "server/planner/costs/excess.h"

#include <algorithm>
#include <cmath>

#include "common/base/multiversion.h"

namespace gatefield::planner {

GATEFIELD_MULTIVERSION void accumulate_excess(float weight, float limit, const float* x, const float* y, const float* z,
                                              int count, float* cost) noexcept {
  for (int m = 0; m < count; ++m) {
    const float excess = std::max(0.0f, std::sqrt(x[m] * x[m] + y[m] * y[m] + z[m] * z[m]) - limit);
    cost[m] += weight * excess * excess;
  }
}

}  // namespace gatefield::planner
