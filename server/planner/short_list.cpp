#include "server/planner/short_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/multiversion.h"
#include "server/planner/annotation.h"

namespace gatefield::planner {
namespace short_list {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

GATEFIELD_MULTIVERSION void gather(const float* from, const int* at, int count, float* to) noexcept {
  for (int i = 0; i < count; ++i) to[i] = from[at[i]];
}

}  // namespace short_list

using short_list::kInfinity;

ShortList::ShortList(const Profile& profile, const RolloutCosts* costs)
    : costs_(costs), steps_(profile.steps), samples_(static_cast<std::size_t>(profile.samples)) {
  const std::size_t blocks = (samples_ + kBlock - 1) / kBlock, padded = blocks * kBlock;
  for (std::vector<float>* buffer : {&before_, &beyond_, &cost_}) buffer->resize(padded);
  positions_.resize(padded * static_cast<std::size_t>(profile.steps) * 3);
  known_.resize(padded);
  chosen_.resize(padded + kBlock);
  scout_of_.resize(blocks);
}

float ShortList::bound_of(std::size_t rollout) const noexcept {
  return known_[rollout] == Known::kCrossing ? std::min(before_[rollout], beyond_[rollout]) : before_[rollout];
}

bool ShortList::bound(const PlanContext& context, int block, RolloutBatch batch, Workspace& work) noexcept {
  const std::size_t first = static_cast<std::size_t>(block) * kBlock, steps = static_cast<std::size_t>(steps_);
  PlanContext open = context;
  open.start_clearance_m = kOpen_m;
  annotate(open, batch.states, work.open.data(), work.along.data(), work.through.data(), work.clearance.data(),
           work.crossing.data());
  batch.along = work.along.data();
  const float* last = work.through.data() + (steps - 1) * kBlock;
  bool crosses = false, returns = false;
  for (std::size_t m = 0; m < kBlock; ++m) crosses |= last[m] > 0.5f;
  if (crosses) {
    for (std::size_t i = 0; i < steps * kBlock; ++i) returns |= work.through[i] > 0.5f && work.along[i] < 0.0f;
  }
  if (returns) return false;

  float* const positions = positions_.data() + first * steps * 3;
  for (int k = 0; k < batch.steps; ++k)
    std::copy_n(batch.states.row(k, kernels::kPx), 3 * kBlock, positions + static_cast<std::size_t>(k) * 3 * kBlock);

  std::fill_n(work.crossing.data(), kBlock, kNoCrossing);
  batch.crossing_clearance = work.crossing.data();
  batch.through = work.zeros.data();
  costs_->weigh_without_field(context, batch, {before_.data() + first, kBlock});
  if (crosses) {
    batch.through = work.through.data();
    costs_->weigh_without_field(context, batch, {beyond_.data() + first, kBlock});
  }
  std::size_t best = first;
  float least = kInfinity;
  for (std::size_t m = first; m < first + static_cast<std::size_t>(batch.samples); ++m) {
    known_[m] = last[m - first] > 0.5f ? Known::kCrossing : Known::kBounded;
    if (const float L = bound_of(m); L < least) {
      least = L;
      best = m;
    }
  }
  scout_of_[static_cast<std::size_t>(block)] = static_cast<int>(best);
  return true;
}

void ShortList::settle(int block, std::span<const float> cost) noexcept {
  const std::ptrdiff_t first = std::ptrdiff_t{block} * kBlock;
  std::copy(cost.begin(), cost.end(), cost_.begin() + first);
  std::fill_n(known_.begin() + first, cost.size(), Known::kSettled);
  scout_of_[static_cast<std::size_t>(block)] = -1;
}

void ShortList::settle(const PlanInput& input, const PlanContext& context, std::span<const int> rollouts) noexcept {
  Workspace& work = workspace();
  const int count = static_cast<int>(rollouts.size());
  RolloutBatch batch;
  batch.steps = steps_;
  batch.samples = count;
  batch.stride = kernels::padded_samples(count);
  batch.states = {work.states.data(), steps_, 3, count, batch.stride};
  const auto rollout = [&](int i) { return rollouts[static_cast<std::size_t>(std::min(i, count - 1))]; };
  int at[kBlock];
  for (int i = 0; i < batch.stride; ++i) at[i] = rollout(i) / kBlock * kBlock * steps_ * 3 + rollout(i) % kBlock;
  for (int row = 0; row < 3 * steps_; ++row)
    short_list::gather(positions_.data() + row * kBlock, at, batch.stride, batch.states.row(0, row));

  costs_->look_at_fields(input, context, work, &batch);
  const float* through = batch.through_row(batch.steps - 1);
  for (int i = 0; i < batch.stride; ++i) {
    const auto m = static_cast<std::size_t>(rollout(i));
    work.cost[static_cast<std::size_t>(i)] = through[i] > 0.5f ? beyond_[m] : before_[m];
  }
  costs_->add_field(context, batch, {work.cost.data(), static_cast<std::size_t>(batch.stride)});
  for (std::size_t i = 0; i < rollouts.size(); ++i) {
    const auto m = static_cast<std::size_t>(rollouts[i]);
    cost_[m] = work.cost[i];
    known_[m] = Known::kSettled;
  }
}

std::span<const int> ShortList::scouts() noexcept {
  std::size_t count = 0;
  for (const int rollout : scout_of_)
    if (rollout >= 0) chosen_[count++] = rollout;
  return {chosen_.data(), count};
}

std::span<const int> ShortList::choose(double temperature) noexcept {
  float best = kInfinity;
  for (std::size_t m = 0; m < samples_; ++m)
    if (known_[m] == Known::kSettled) best = std::min(best, cost_[m]);  // NaN never is the lesser
  const double margin = temperature * (20.0 + std::log(static_cast<double>(samples_)));
  const float limit = std::nextafter(static_cast<float>(best + margin), kInfinity);

  std::size_t straight = 0, crossing = 0;
  for (std::size_t m = 0; m < samples_; ++m) {
    if (known_[m] == Known::kSettled) continue;
    cost_[m] = kInfinity;
    if (!(bound_of(m) <= limit)) continue;
    if (known_[m] == Known::kBounded)
      chosen_[straight++] = static_cast<int>(m);
    else
      chosen_[samples_ - 1 - crossing++] = static_cast<int>(m);
  }
  std::copy_n(chosen_.begin() + static_cast<std::ptrdiff_t>(samples_ - crossing), crossing,
              chosen_.begin() + static_cast<std::ptrdiff_t>(straight));
  return {chosen_.data(), straight + crossing};
}

int ShortList::settled() const noexcept {
  return static_cast<int>(
      std::count(known_.begin(), known_.begin() + static_cast<std::ptrdiff_t>(samples_), Known::kSettled));
}

}  // namespace gatefield::planner
