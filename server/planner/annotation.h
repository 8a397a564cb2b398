#pragma once

#include "server/planner/rollout_batch.h"

namespace gatefield::planner {

/// Where each rollout goes through the gate's plane, which several costs want to know. Fills, per block of rollouts:
///   along[k]            signed distance x to the plane of the target gate
///   through[k]          1 from the step on in which the plane is crossed forwards, with a positive clearance there
///   crossing_clearance  the least clearance c(x) over the slab |x| <= slab_half around a crossing, taken as linear
///                       between the two states beside it; kNoCrossing without one. Forward crossings count always,
///                       backward ones when they would hit the frame: far outside is the way back around the gate.
///                       States within the slab count as well, before and after the crossing, since a vehicle that
///                       turns in the opening meets a post. Far outside the frame they don't.
/// The clearance at a point is s - |x| tan(alpha) = c - r: the decoder's value less the hourglass's widening. Along a
/// line it is concave, so that interpolating linearly never claims more room than there is. Without a field it is
/// inner_half - distance from the axis.
///
/// @param field                      [K][stride], the target's Gate-SDF; null: none
/// @param along, through, clearance  [K][stride], written; `clearance` is scratch
/// @param crossing_clearance         [stride], written
/// Thread-safe: yes.   Real-time safe: yes.
void annotate(const PlanContext& context, const kernels::SampleBlock& states, const float* field, float* along,
              float* through, float* clearance, float* crossing_clearance) noexcept;

}  // namespace gatefield::planner
