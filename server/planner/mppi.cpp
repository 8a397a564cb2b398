#include "server/planner/mppi.h"

#include <algorithm>
#include <cmath>

#include "common/base/multiversion.h"
#include "common/base/random.h"
#include "server/planner/applied_disturbance.h"

namespace gatefield::planner {
namespace mppi {

/// White samples to ones of the same spread of which each remembers the step before it, around the mean.
GATEFIELD_MULTIVERSION void correlate(const float* mean, float keep, float fresh, int steps, int stride,
                                      float* inputs) noexcept {
  const int rows = kernels::kInputs;
  for (int i = rows; i < steps * rows; ++i) {
    float* here = inputs + i * stride;
    const float* before = here - rows * stride;
    for (int m = 0; m < stride; ++m)
      here[m] = mean[i] + keep * (before[m] - mean[i - rows]) + fresh * (here[m] - mean[i]);
  }
}

}  // namespace mppi

namespace {

/// Scouts are decoded this many at a time, so that threads share them.
constexpr int kScouts = 32;

}  // namespace

Mppi::Mppi(const Profile& profile, const QuadrotorModel& model, const Course& course, double cone_angle_rad,
           std::uint64_t seed, const PlannerOptions& options)
    : profile_(profile),
      key_(stream_key(seed, Stream("gatefield.rollouts"))),
      crew_(options.crew),
      backend_(options.backend != nullptr ? options.backend : &kernels::best_backend()),
      drive_(Drive::make(profile, model, options.actuation)),
      noise_(drive_->noise()),
      costs_(profile),
      guidance_(profile, model, course, cone_angle_rad),
      mean_(static_cast<std::size_t>(profile.steps), drive_->still()),
      steps_(static_cast<std::size_t>(profile.steps)),
      blocks_((profile.samples + kBlock - 1) / kBlock) {
  // An adaptive temperature is known only when all costs are.
  if (options.leave_out && costs_.bounded_below() && profile.target_effective_fraction <= 0)
    short_list_.emplace(profile, &costs_);
  const std::size_t blocks = static_cast<std::size_t>(blocks_), padded = blocks * kBlock;
  inputs_.resize(padded * steps_ * kernels::kInputs);
  for (std::vector<float>* buffer : {&cost_, &weight_}) buffer->resize(padded);
  flat_mean_.resize(steps_ * kernels::kInputs);
  sums_.resize(blocks * steps_ * kernels::kInputs);
  prepare_thread();
}

void Mppi::reset() noexcept { std::fill(mean_.begin(), mean_.end(), drive_->still()); }

bool Mppi::restore(const WarmStart& start) {
  const auto finite = [](const PlainVector4& input) { return input.allFinite(); };
  if (start.mean.size() != mean_.size() || !std::all_of(start.mean.begin(), start.mean.end(), finite) ||
      !start.asked.allFinite() || std::abs(start.detour_side) != 1.0)
    return false;
  mean_ = start.mean;
  drive_->restore(start.asked);
  guidance_.take_side(start.detour_side);
  return true;
}

kernels::SampleBlock Mppi::inputs_of(int block) noexcept {
  const std::size_t size = steps_ * kernels::kInputs * kBlock;
  return {inputs_.data() + static_cast<std::size_t>(block) * size, profile_.steps, kernels::kInputs, samples_in(block),
          kBlock};
}

/// Samples and states of one block.
RolloutBatch Mppi::roll_out(const PlanInput& input, int block, Workspace& work) noexcept {
  const kernels::SampleBlock inputs = inputs_of(block);
  RolloutBatch batch;
  batch.states = {work.states.data(), profile_.steps, kernels::kStateChannels, inputs.samples, kBlock};
  batch.steps = profile_.steps;
  batch.samples = inputs.samples;
  batch.stride = kBlock;
  backend_->sample(noise_, key_, input.step, block * kBlock, flat_mean_.data(), inputs);
  if (drive_->noise_correlation() > 0) {
    const auto keep = static_cast<float>(drive_->noise_correlation());
    mppi::correlate(flat_mean_.data(), keep, std::sqrt(1.0f - keep * keep), profile_.steps, kBlock, inputs.data);
  }
  drive_->roll_out(*backend_, input, inputs, batch.states);
  apply_disturbance(input.disturbance_W_m_s2, profile_.step_s, batch);
  return batch;
}

/// The whole cost of each rollout of a block.
std::span<const float> Mppi::weigh_whole(const PlanInput& input, const PlanContext& context, int block,
                                         RolloutBatch batch, Workspace& work) noexcept {
  float* const cost = cost_.data() + static_cast<std::size_t>(block) * kBlock;
  costs_.look_at_fields(input, context, work, &batch);
  costs_.weigh_without_field(context, batch, {cost, kBlock});
  costs_.add_field(context, batch, {cost, kBlock});
  if (observer_ != nullptr) observer_->see(batch, block * kBlock);
  return {cost, static_cast<std::size_t>(batch.samples)};
}

/// Whole costs of all rollouts.
std::span<const float> Mppi::weigh_all(const PlanInput& input, const PlanContext& context) noexcept {
  const auto whole = [&](int block) {
    Workspace& work = workspace();
    weigh_whole(input, context, block, roll_out(input, block, work), work);
  };
  kernels::share(observer_ == nullptr ? crew_ : nullptr, blocks_, whole);
  return {cost_.data(), static_cast<std::size_t>(profile_.samples)};
}

/// Whole costs of all rollouts that may get weight, infinity for the others.
std::span<const float> Mppi::weigh_hopeful(const PlanInput& input, const PlanContext& context) noexcept {
  kernels::share(crew_, blocks_, [&](int block) {
    Workspace& work = workspace();
    const RolloutBatch batch = roll_out(input, block, work);
    if (!short_list_->bound(context, block, batch, work))
      short_list_->settle(block, weigh_whole(input, context, block, batch, work));
  });
  const auto settle = [&](std::span<const int> rollouts, std::size_t at_once) {
    const auto parts = static_cast<int>((rollouts.size() + at_once - 1) / at_once);
    kernels::share(crew_, parts, [&](int part) {
      const std::size_t first = static_cast<std::size_t>(part) * at_once;
      short_list_->settle(input, context, rollouts.subspan(first, std::min(at_once, rollouts.size() - first)));
    });
  };
  settle(short_list_->scouts(), kScouts);
  // Costs don't depend on which rollouts share a block, so threads get equal parts.
  const std::span<const int> hopeful = short_list_->choose(profile_.temperature);
  settle(hopeful, hopeful.size() > 8 * kBlock ? kBlock : kBlock / 2);
  return short_list_->costs();
}

/// mean_ = the samples' weighted average, block by block and the blocks' sums in their order.
void Mppi::average() noexcept {
  const std::size_t inputs = steps_ * kernels::kInputs;
  kernels::share(crew_, blocks_, [&](int block) {
    double* const sum = sums_.data() + static_cast<std::size_t>(block) * inputs;
    std::fill_n(sum, inputs, 0.0);
    const float* weight = weight_.data() + static_cast<std::size_t>(block) * kBlock;
    const auto count = static_cast<std::size_t>(samples_in(block));
    if (std::all_of(weight, weight + count, [](float w) { return w == 0.0f; })) return;
    backend_->accumulate_average({weight, count}, inputs_of(block), sum);
  });
  for (std::size_t i = 0; i < inputs; ++i) {
    double sum = 0.0;
    for (std::size_t block = 0; block < static_cast<std::size_t>(blocks_); ++block) sum += sums_[block * inputs + i];
    mean_[i / kernels::kInputs][static_cast<Eigen::Index>(i % kernels::kInputs)] = sum;
  }
}

void Mppi::plan(const PlanInput& input, Plan* plan) noexcept {
  drive_->begin(input, mean_);
  for (std::size_t k = 0; k < steps_; ++k)
    for (std::size_t i = 0; i < kernels::kInputs; ++i)
      flat_mean_[k * kernels::kInputs + i] = static_cast<float>(mean_[k][static_cast<Eigen::Index>(i)]);

  const PlanContext context = guidance_.context(input);
  const bool field_known = costs_.want_fields() && input.target.field != nullptr && !input.hold;
  const bool leave_out = short_list_ && field_known && observer_ == nullptr;
  const std::span<const float> cost = leave_out ? weigh_hopeful(input, context) : weigh_all(input, context);
  plan->decoded_rollouts = !field_known ? 0 : leave_out ? short_list_->settled() : profile_.samples;

  plan->temperature = profile_.temperature;
  if (profile_.target_effective_fraction > 0)
    plan->temperature =
        backend_->temperature_for(cost, profile_.target_effective_fraction * static_cast<double>(cost.size()),
                                  profile_.temperature_min, profile_.temperature_max);
  plan->effective_samples = backend_->softmax_weights(cost, plan->temperature, {weight_.data(), cost.size()});
  plan->ok = plan->effective_samples > 0;
  if (plan->ok) average();
  predict(input, plan);
}

void Mppi::predict(const PlanInput& input, Plan* plan) const noexcept {
  plan->steps = profile_.steps;
  DrivenState state = drive_->start(input);
  plan->lowest_field_m = 0.0;
  float x[kMaxSteps], y[kMaxSteps], z[kMaxSteps], s[kMaxSteps];
  for (std::size_t k = 0; k < steps_; ++k) {
    drive_->move(input, mean_[k], k, &state, plan);
    apply_disturbance(input.disturbance_W_m_s2, profile_.step_s, &state.body);
    plan->state[k] = state.body;
    x[k] = static_cast<float>(state.body.p_WB.x());
    y[k] = static_cast<float>(state.body.p_WB.y());
    z[k] = static_cast<float>(state.body.p_WB.z());
  }
  if (input.target.field != nullptr) {
    input.target.field->evaluate({x, steps_}, {y, steps_}, {z, steps_}, {s, steps_});
    plan->lowest_field_m = *std::min_element(s, s + steps_);
  }
}

Result<std::unique_ptr<Planner>> Planner::create(const Profile& profile, const QuadrotorModel& model,
                                                 const Course& course, double cone_angle_rad, std::uint64_t seed,
                                                 const PlannerOptions& options) {
  if (Status status = validate(profile); !status) return status.failure();
  if (Status status = gatefield::validate(model); !status) return status.failure();
  if (Status status = gatefield::validate(options.actuation); !status) return status.failure();
  if (Status status = gatefield::validate(course); !status) return status.failure();
  if (Status status = check_heights(profile, model, course); !status) return status.failure();
  return std::unique_ptr<Planner>(std::make_unique<Mppi>(profile, model, course, cone_angle_rad, seed, options));
}

void Planner::prepare_thread() { workspace(); }

}  // namespace gatefield::planner
