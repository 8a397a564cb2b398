#pragma once

#include <vector>

#include "server/planner/annotation.h"
#include "server/planner/rollout_batch.h"

namespace gatefield::test {

/// A block of rollouts whose states a test writes by hand. Everything else is "not crossed, not through, no field".
class BatchFixture {
 public:
  BatchFixture(int steps, int samples)
      : steps_(steps),
        stride_((samples + 15) / 16 * 16),
        states_(static_cast<std::size_t>(steps * kernels::kStateChannels * stride_), 0.0f),
        along_(rows(), -1.0f),
        through_(rows(), 0.0f),
        field_(rows(), 0.0f),
        next_field_(rows(), 0.0f),
        clearance_(rows(), 0.0f),
        crossing_(static_cast<std::size_t>(stride_), planner::kNoCrossing) {
    batch.states = {states_.data(), steps, kernels::kStateChannels, samples, stride_};
    batch.steps = steps;
    batch.samples = samples;
    batch.stride = stride_;
    batch.along = along_.data();
    batch.through = through_.data();
    batch.crossing_clearance = crossing_.data();
    for (int k = 0; k < steps; ++k)
      for (int m = 0; m < stride_; ++m) at(k, kernels::kQw, m) = 1.0f;
  }

  float& at(int k, kernels::StateChannel channel, int m) const { return batch.states.row(k, channel)[m]; }
  void place(int k, int m, const Eigen::Vector3f& p_WB) const {
    at(k, kernels::kPx, m) = p_WB.x();
    at(k, kernels::kPy, m) = p_WB.y();
    at(k, kernels::kPz, m) = p_WB.z();
  }
  float& along(int k, int m) { return along_[index(k, m)]; }
  float& through(int k, int m) { return through_[index(k, m)]; }
  float& field(int k, int m) {
    batch.field = field_.data();
    return field_[index(k, m)];
  }
  float& next_field(int k, int m) {
    batch.next_field = next_field_.data();
    return next_field_[index(k, m)];
  }
  float& crossing(int m) { return crossing_[static_cast<std::size_t>(m)]; }

  std::vector<float> cost_of(const auto& term, const planner::PlanContext& context) {
    std::vector<float> cost(static_cast<std::size_t>(stride_), 0.0f);
    term.accumulate(context, batch, cost);
    return cost;
  }
  void annotate(const planner::PlanContext& context) {
    planner::annotate(context, batch.states, batch.field, along_.data(), through_.data(), clearance_.data(),
                      crossing_.data());
  }

  planner::RolloutBatch batch;

 private:
  std::size_t rows() const { return static_cast<std::size_t>(steps_ * stride_); }
  std::size_t index(int k, int m) const { return static_cast<std::size_t>(k * stride_ + m); }

  int steps_;
  int stride_;
  std::vector<float> states_, along_, through_, field_, next_field_, clearance_, crossing_;
};

/// A context with the target gate at the origin, passed along +x, and the next one 8 m beyond it to the left.
inline planner::PlanContext context_at_origin(bool funnel = false) {
  planner::PlanContext context;
  context.target = planner::make_guidance({0, 0, 0}, {1, 0, 0}, funnel, 0.7, 1.5, 0.75, 1.0);
  context.next = planner::make_guidance({6, 6, 0}, {0, 1, 0}, funnel, 0.7, 1.5, 0.75, 1.0);
  context.has_next = true;
  context.start_p_WB = {-3, 0, 0};
  context.start_along_m = -3;
  context.start_clearance_m = 0.5f;
  context.speed_limit_m_s = 7;
  context.crossing_need_m = 0.21f;
  context.passed_need_m = 0.21f;
  context.frame = context.passed_frame = {.inner_half_m = 0.5f, .width_m = 0.25f, .slab_half_m = 0.16f};
  context.cone_slope = 0.36397f;
  context.lowest_m = -100.0f;
  context.highest_m = 100.0f;
  return context;
}

}  // namespace gatefield::test
