#include "server/planner/annotation.h"

#include <algorithm>
#include <cmath>

#include "common/base/multiversion.h"

namespace gatefield::planner {
namespace annotation {

GATEFIELD_MULTIVERSION void distances(const Guidance& target_in, float inner_half_m, float cone_slope, const float* x,
                                      const float* y, const float* z, const float* field, int count, float* along,
                                      float* clearance) noexcept {
  const Guidance target = target_in;
  for (int m = 0; m < count; ++m) {
    const float dx = x[m] - target.cx, dy = y[m] - target.cy, dz = z[m] - target.cz;
    const float a = dx * target.ax + dy * target.ay + dz * target.az;
    along[m] = a;
    if (field != nullptr) {
      clearance[m] = field[m] - std::abs(a) * cone_slope;
    } else {
      clearance[m] = inner_half_m - std::sqrt(std::max(0.0f, dx * dx + dy * dy + dz * dz - a * a));
    }
  }
}

struct Slab {
  float half_m;
  float outside_m;  ///< clearance below which a crossing goes by outside the frame
};

/// `through0` is not the row that is written. Conditions are combined without branches, so that the loop vectorises.
GATEFIELD_MULTIVERSION void crossings(const Slab& slab_in, const float* a0, const float* a1, const float* c0,
                                      const float* c1, const float* through0, int count, float* __restrict through1,
                                      float* __restrict crossing) noexcept {
  const Slab slab = slab_in;
  for (int m = 0; m < count; ++m) {
    const bool forward = (a0[m] < 0.0f) & (a1[m] >= 0.0f);
    const bool backward = (a0[m] >= 0.0f) & (a1[m] < 0.0f);
    const float span = a1[m] - a0[m];
    const float safe_span = std::abs(span) > 1e-6f ? span : 1e-6f;
    const float slope = (c1[m] - c0[m]) / safe_span;
    const float at_plane = c0[m] - a0[m] * slope;
    const float least = at_plane - std::abs(slope) * slab.half_m;
    const bool counts = (through0[m] < 0.5f) & (forward | (backward & (at_plane > slab.outside_m)));
    const float before = crossing[m];
    const float crossed = (counts & (least < before)) ? least : before;
    const bool inside = (std::abs(a1[m]) < slab.half_m) & (c1[m] > slab.outside_m);
    crossing[m] = (inside & (c1[m] < crossed)) ? c1[m] : crossed;
    through1[m] = ((through0[m] > 0.5f) | (forward & (at_plane > 0.0f))) ? 1.0f : 0.0f;
  }
}

}  // namespace annotation

void annotate(const PlanContext& context, const kernels::SampleBlock& states, const float* field, float* along,
              float* through, float* clearance, float* crossing_clearance) noexcept {
  const int stride = states.stride;
  const auto row = [stride](float* rows, int k) { return rows + static_cast<std::ptrdiff_t>(k) * stride; };
  for (int k = 0; k < states.steps; ++k)
    annotation::distances(context.target, context.frame.inner_half_m, context.cone_slope, states.row(k, kernels::kPx),
                          states.row(k, kernels::kPy), states.row(k, kernels::kPz),
                          field != nullptr ? field + static_cast<std::ptrdiff_t>(k) * stride : nullptr, stride,
                          row(along, k), row(clearance, k));

  // All rollouts start at the same point: step 0 is compared with it, through rows that are overwritten in turn.
  const annotation::Slab slab{context.frame.slab_half_m, -(context.frame.width_m + context.crossing_need_m)};
  constexpr int kChunk = 64;
  float start_along[kChunk], start_clearance[kChunk], start_through[kChunk];
  std::fill_n(start_along, kChunk, context.start_along_m);
  std::fill_n(start_clearance, kChunk, context.start_clearance_m);
  std::fill_n(start_through, kChunk, 0.0f);
  std::fill_n(crossing_clearance, stride, kNoCrossing);
  for (int m = 0; m < stride; m += kChunk) {
    const int count = std::min(kChunk, stride - m);
    annotation::crossings(slab, start_along, row(along, 0) + m, start_clearance, row(clearance, 0) + m, start_through,
                          count, row(through, 0) + m, crossing_clearance + m);
  }
  for (int k = 1; k < states.steps; ++k)
    annotation::crossings(slab, row(along, k - 1), row(along, k), row(clearance, k - 1), row(clearance, k),
                          row(through, k - 1), stride, row(through, k), crossing_clearance);
}

}  // namespace gatefield::planner
