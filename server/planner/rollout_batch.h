#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "common/geometry/gate.h"
#include "common/vehicle/quadrotor.h"
#include "server/kernels/rollout/rollout.h"
#include "server/planner/costs/guidance.h"
#include "server/planner/profile.h"

namespace gatefield::planner {

/// Rollouts per block: states, inputs and fields of a block stay in a core's second-level cache.
inline constexpr int kBlock = 128;

/// One block of rollouts with what the costs look at. Rows are [stride] floats, one per rollout; row k is the state at
/// the end of step k. Non-owning.
struct RolloutBatch {
  kernels::SampleBlock states;  ///< [K][kernels::StateChannel][M]
  int steps = 0;
  int samples = 0;
  int stride = 0;
  const float* along = nullptr;       ///< [K] signed distance to the target gate's plane, negative before it, m
  const float* through = nullptr;     ///< [K] 1 once the rollout has gone through the target's opening, else 0
  const float* field = nullptr;       ///< [K] Gate-SDF of the target, m; null when there is no field
  const float* next_field = nullptr;  ///< [K] Gate-SDF of the gate after it, m; null when there is none
  /// Least distance from the centre of mass to the frame's inner edge while crossing the gate's slab, m; kNoCrossing
  /// when the plane was not crossed. One row.
  const float* crossing_clearance = nullptr;

  const float* along_row(int k) const noexcept { return along + static_cast<std::ptrdiff_t>(k) * stride; }
  const float* through_row(int k) const noexcept { return through + static_cast<std::ptrdiff_t>(k) * stride; }
  const float* field_row(int k) const noexcept { return field + static_cast<std::ptrdiff_t>(k) * stride; }
  const float* next_field_row(int k) const noexcept { return next_field + static_cast<std::ptrdiff_t>(k) * stride; }
};

inline constexpr float kNoCrossing = 1e6f;

/// Measures of one gate's frame.
struct FrameSize {
  float inner_half_m = 0.0f;
  float width_m = 0.0f;      ///< outer minus inner half-width
  float slab_half_m = 0.0f;  ///< half thickness + the vehicle's radius
};

/// What is the same for all rollouts of one step.
struct PlanContext {
  Guidance target;           ///< where to go before the opening
  Guidance next;             ///< and beyond it
  FrameSize frame;           ///< the target's
  float target_size = 1.0f;  ///< gates::gate_size(): a profile's lengths that belong to the gate count times this
  float next_size = 1.0f;
  bool has_next = false;
  /// The way to the next gate counts from as far beyond the target's centre, along its axis.
  float next_from_m = 0.0f;
  Guidance passed_gate;    ///< where the gate is that the vehicle passed last, when it is near
  FrameSize passed_frame;  ///< and its frame
  bool has_passed_gate = false;
  bool hold = false;
  Eigen::Vector3f start_p_WB = Eigen::Vector3f::Zero();
  float start_along_m = 0.0f;
  float start_clearance_m = 0.0f;  ///< field minus the cone's widening at the start, see annotate()
  float speed_limit_m_s = 0.0f;    ///< after all tightening
  float crossing_need_m = 0.0f;    ///< clearance wanted while crossing: radius + margin (+ extra when the field is old)
  float passed_need_m = 0.0f;      ///< the same of the gate passed last
  float cone_slope = 0.0f;         ///< tan(alpha)
  float lowest_m = 0.0f;           ///< heights to stay between, world frame
  float highest_m = 0.0f;
  /// Of the vehicle, about each axis of B; 0: no less than the profile's limit.
  Eigen::Vector3f body_rate_limit_rad_s = Eigen::Vector3f::Zero();
};

}  // namespace gatefield::planner
