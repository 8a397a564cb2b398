#pragma once

#include <Eigen/Core>

#include "server/planner/rollout_batch.h"

/// A constant acceleration a beyond the model (wind, mass or drag unlike what was told), applied to what was rolled out
/// without it. That drag then differs, and rotation, are left out:
///   p(t) += a t^2 / 2,   v(t) += a t
/// Thread-safe: yes.   Real-time safe: yes.
namespace gatefield::planner {

/// To every rollout of a block; step k ends at t = (k + 1) step_s. Nothing is touched when a_W is zero.
/// @param batch  its states have kPx to kVz
void apply_disturbance(const Eigen::Vector3d& a_W, double step_s, const RolloutBatch& batch) noexcept;

/// To a state that moved on by one step of t = step_s; then drag acts on what was added before.
void apply_disturbance(const Eigen::Vector3d& a_W, double step_s, QuadrotorState* state) noexcept;

}  // namespace gatefield::planner
