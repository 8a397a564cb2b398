#include "server/planner/applied_disturbance.h"

#include "common/base/multiversion.h"

namespace gatefield::planner {
namespace applied_disturbance {

GATEFIELD_MULTIVERSION void add(float value, int count, float* to) noexcept {
  for (int i = 0; i < count; ++i) to[i] += value;
}

}  // namespace applied_disturbance

void apply_disturbance(const Eigen::Vector3d& a_W, double step_s, const RolloutBatch& batch) noexcept {
  if (a_W.isZero(0.0)) return;
  for (int k = 0; k < batch.steps; ++k) {
    const double t_s = (k + 1) * step_s;
    for (int axis = 0; axis < 3; ++axis) {
      applied_disturbance::add(static_cast<float>(0.5 * t_s * t_s * a_W[axis]), batch.stride,
                               batch.states.row(k, kernels::kPx + axis));
      applied_disturbance::add(static_cast<float>(t_s * a_W[axis]), batch.stride,
                               batch.states.row(k, kernels::kVx + axis));
    }
  }
}

void apply_disturbance(const Eigen::Vector3d& a_W, double step_s, QuadrotorState* state) noexcept {
  state->p_WB += 0.5 * step_s * step_s * a_W;
  state->v_WB += step_s * a_W;
}

}  // namespace gatefield::planner
