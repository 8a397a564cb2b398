#include "server/planner/rollout_costs.h"

#include <algorithm>

#include "server/planner/annotation.h"

namespace gatefield::planner {
namespace {

void decode(const Field& field, const RolloutBatch& batch, std::vector<float>& out) noexcept {
  const std::size_t count = static_cast<std::size_t>(batch.stride);
  for (int k = 0; k < batch.steps; ++k) {
    const kernels::SampleBlock& states = batch.states;
    field.evaluate({states.row(k, kernels::kPx), count}, {states.row(k, kernels::kPy), count},
                   {states.row(k, kernels::kPz), count}, {out.data() + static_cast<std::size_t>(k) * count, count});
  }
}

bool any_through(const RolloutBatch& batch) noexcept {
  const float* last = batch.through_row(batch.steps - 1);
  return std::any_of(last, last + batch.stride, [](float through) { return through > 0.5f; });
}

}  // namespace

Workspace::Workspace() {
  constexpr std::size_t rows = std::size_t{kMaxSteps} * kBlock;
  states.resize(rows * kernels::kStateChannels);
  for (std::vector<float>* buffer : {&along, &through, &clearance, &field, &next_field, &zeros}) buffer->resize(rows);
  open.assign(rows, kOpen_m);
  crossing.resize(kBlock);
  cost.resize(kBlock);
}

Workspace& workspace() {
  thread_local Workspace of_this_thread;
  return of_this_thread;
}

RolloutCosts::RolloutCosts(const Profile& profile)
    : terms_(make_terms(profile)), want_fields_(profile.field_weight > 0 || profile.crossing_weight > 0) {
  std::stable_partition(terms_.begin(), terms_.end(), [](const auto& t) { return t->field_use() == FieldUse::kNone; });
  for (const auto& term : terms_) {
    free_terms_ += term->field_use() == FieldUse::kNone ? 1 : 0;
    if (term->field_use() == FieldUse::kAny) bounded_below_ = false;
  }
}

void RolloutCosts::look_at_fields(const PlanInput& input, const PlanContext& context, Workspace& work,
                                  RolloutBatch* batch) const noexcept {
  if (want_fields_ && input.target.field != nullptr && !input.hold) {
    decode(*input.target.field, *batch, work.field);
    batch->field = work.field.data();
  }
  annotate(context, batch->states, batch->field, work.along.data(), work.through.data(), work.clearance.data(),
           work.crossing.data());
  batch->along = work.along.data();
  batch->through = work.through.data();
  batch->crossing_clearance = work.crossing.data();
  if (want_fields_ && input.has_next && input.next.field != nullptr && any_through(*batch)) {
    decode(*input.next.field, *batch, work.next_field);
    batch->next_field = work.next_field.data();
  }
}

void RolloutCosts::weigh_without_field(const PlanContext& context, const RolloutBatch& batch,
                                       std::span<float> cost) const noexcept {
  std::fill(cost.begin(), cost.end(), 0.0f);
  for (std::size_t i = 0; i < free_terms_; ++i) terms_[i]->accumulate(context, batch, cost);
}

void RolloutCosts::add_field(const PlanContext& context, const RolloutBatch& batch,
                             std::span<float> cost) const noexcept {
  for (std::size_t i = free_terms_; i < terms_.size(); ++i) terms_[i]->accumulate(context, batch, cost);
}

}  // namespace gatefield::planner
