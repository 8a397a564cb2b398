#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/base/multiversion.h"
#include "server/kernels/average/average.h"
#include "server/kernels/noise/noise.h"
#include "server/planner/annotation.h"
#include "server/planner/costs/cost_term.h"
#include "server/planner/planner.h"
#include "server/planner/warm_start.h"

namespace gatefield::planner {
namespace {

/// Rollouts per block: states, inputs and fields of a block stay in a core's second-level cache.
constexpr int kBlock = 128;
/// Field-free rollouts of each block whose whole cost is found first, see PlannerOptions::leave_out: the one of least
/// cost. They are decoded this many at a time, so that threads share them.
constexpr int kScouts = 32;
/// A field that is free everywhere: every forward crossing goes through the opening.
constexpr float kOpen_m = 1e4f;

/// The gate passed last is out of the way beyond this distance.
constexpr double kLeftNear_m = 3.0;

/// What a thread needs for the block it is working on.
struct Workspace {
  std::vector<float> states, along, passed, clearance, field, next_field, crossing, zeros, open, cost;

  Workspace() {
    constexpr std::size_t rows = std::size_t{kMaxSteps} * kBlock;
    states.resize(rows * kernels::kStateChannels);
    for (std::vector<float>* buffer : {&along, &passed, &clearance, &field, &next_field, &zeros}) buffer->resize(rows);
    open.assign(rows, kOpen_m);
    crossing.resize(kBlock);
    cost.resize(kBlock);
  }
};

Workspace& workspace() {
  thread_local Workspace of_this_thread;
  return of_this_thread;
}

/// What is known of a rollout's cost before the field is asked.
enum class Known : std::uint8_t {
  kBounded,  ///< `before` when it doesn't pass the opening, which depends on the field, else `beyond`; plus the field's
  kCrossing,  ///< the same, and it crosses the plane: both are to be looked at
  kWhole,     ///< `cost` is the whole cost
};

namespace mppi {

/// White samples to ones of the same spread of which each remembers the step before it:
/// e_k = rho e_(k-1) + sqrt(1 - rho^2) n_k around the mean.
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

GATEFIELD_MULTIVERSION void add(float value, int count, float* to) noexcept {
  for (int i = 0; i < count; ++i) to[i] += value;
}

GATEFIELD_MULTIVERSION void gather(const float* from, const int* at, int count, float* to) noexcept {
  for (int i = 0; i < count; ++i) to[i] = from[at[i]];
}

}  // namespace mppi

/// Signs of collective, roll, pitch and yaw on each rotor, from where the rotors are and how they turn.
kernels::NoiseShape noise_shape(const Profile& profile, const QuadrotorModel& model) {
  kernels::NoiseShape shape;
  for (std::size_t i = 0; i < kRotors; ++i) {
    shape.sigma[i] = static_cast<float>(profile.noise_sigma_n_s[i]);
    const Eigen::Vector2d& position = model.rotor_position_B_m[i];
    shape.mixer[i] = {1.0f, position.y() >= 0 ? 1.0f : -1.0f, position.x() >= 0 ? -1.0f : 1.0f,
                      model.rotor_spin[i] >= 0 ? 1.0f : -1.0f};
  }
  return shape;
}

class Mppi final : public Planner {
 public:
  Mppi(const Profile& profile, const QuadrotorModel& model, const GateShape& gate, double cone_angle_rad,
       std::uint64_t seed, const PlannerOptions& options)
      : profile_(profile),
        model_(model),
        gate_(gate),
        seed_(seed),
        options_(options),
        noise_(noise_shape(profile, model)),
        terms_(make_terms(profile)),
        mean_(static_cast<std::size_t>(profile.steps), ThrustRates::Zero()) {
    model_.thrust_rate_max_n_s = std::min(model.thrust_rate_max_n_s, profile.thrust_rate_limit_n_s);
    cone_slope_ = static_cast<float>(std::tan(cone_angle_rad));
    std::stable_partition(terms_.begin(), terms_.end(),
                          [](const auto& t) { return t->field_use() == FieldUse::kNone; });
    for (const auto& term : terms_) {
      free_terms_ += term->field_use() == FieldUse::kNone ? 1 : 0;
      if (term->field_use() == FieldUse::kAny) options_.leave_out = false;
    }
    if (profile.target_effective_fraction > 0) options_.leave_out = false;
    steps_ = static_cast<std::size_t>(profile.steps);
    blocks_ = (profile.samples + kBlock - 1) / kBlock;
    const std::size_t blocks = static_cast<std::size_t>(blocks_), padded = blocks * kBlock;
    inputs_.resize(padded * steps_ * kernels::kInputs);
    for (std::vector<float>* buffer : {&cost_, &weight_}) buffer->resize(padded);
    if (options_.leave_out) {
      positions_.resize(padded * steps_ * 3);
      for (std::vector<float>* buffer : {&before_, &beyond_}) buffer->resize(padded);
      known_.resize(padded);
      chosen_.resize(padded + kBlock);
      scouts_.resize(blocks);
    }
    flat_mean_.resize(steps_ * kernels::kInputs);
    sums_.resize(blocks * steps_ * kernels::kInputs);
    prepare_thread();
  }

  void plan(const PlanInput& input, Plan* plan) noexcept override;
  void reset() noexcept override { std::fill(mean_.begin(), mean_.end(), ThrustRates::Zero()); }
  WarmStart warm_start() const override { return {mean_, detour_side_}; }
  bool restore(const WarmStart& start) override;
  const Profile& profile() const noexcept override { return profile_; }

 private:
  PlanContext context(const PlanInput& input) noexcept;
  bool fields_wanted() const noexcept { return profile_.field_weight > 0 || profile_.crossing_weight > 0; }

  RolloutBatch roll_out(const PlanInput& input, int block, Workspace& work) noexcept;
  void add_disturbance(const Eigen::Vector3d& a_W, const RolloutBatch& batch) const noexcept;
  void weigh_whole(const PlanInput& input, const PlanContext& context, int block, RolloutBatch batch, Workspace& work,
                   float* cost) noexcept;
  void weigh_without_field(const PlanInput& input, const PlanContext& context, int block) noexcept;
  void weigh_chosen(const PlanInput& input, const PlanContext& context, const int* chosen, int count) noexcept;
  int weigh_hopeful(const PlanInput& input, const PlanContext& context) noexcept;
  void average() noexcept;
  void predict(const PlanInput& input, Plan* plan) const noexcept;

  /// body(i) for i in [0, count), on this thread and on free ones of the crew.
  template <typename Body>
  void share(int count, const Body& body) noexcept {
    if (options_.crew != nullptr) return options_.crew->run(count, body);
    for (int i = 0; i < count; ++i) body(i);
  }

  int samples_in(int block) const noexcept { return std::min(kBlock, profile_.samples - block * kBlock); }
  kernels::SampleBlock inputs_of(int block) noexcept {
    const std::size_t size = steps_ * kernels::kInputs * kBlock;
    return {inputs_.data() + static_cast<std::size_t>(block) * size, profile_.steps, kernels::kInputs,
            samples_in(block), kBlock};
  }
  /// Least whole cost that rollout m can have. @pre !kWhole
  float bound(std::size_t m) const noexcept {
    return known_[m] == Known::kCrossing ? std::min(before_[m], beyond_[m]) : before_[m];
  }

  Profile profile_;
  QuadrotorModel model_;
  GateShape gate_;
  std::uint64_t seed_;
  PlannerOptions options_;
  float cone_slope_ = 0.0f;
  kernels::NoiseShape noise_;
  std::vector<std::unique_ptr<const CostTerm>> terms_;  ///< those that don't use the field come first
  std::size_t free_terms_ = 0;                          ///< how many of those there are
  std::vector<ThrustRates> mean_;                       ///< U*, starts the next step
  double detour_side_ = 1.0;  ///< see context(): hysteresis of the way back around a missed gate
  std::size_t steps_ = 0;
  int blocks_ = 0;

  // Sized once; each block of rollouts writes its own part.
  std::vector<float> inputs_;                           ///< [block][K][4][kBlock], kept until the average
  std::vector<float> positions_;                        ///< [block][K][3][kBlock]
  std::vector<float> before_, beyond_, cost_, weight_;  ///< [M]
  std::vector<Known> known_;                            ///< [M]
  std::vector<int> chosen_, scouts_;                    ///< numbers of rollouts
  std::vector<float> flat_mean_;
  std::vector<double> sums_;  ///< [block][K][4]
};

bool Mppi::restore(const WarmStart& start) {
  const auto finite = [](const ThrustRates& rates) { return rates.allFinite(); };
  if (start.mean.size() != mean_.size() || !std::all_of(start.mean.begin(), start.mean.end(), finite) ||
      std::abs(start.detour_side) != 1.0)
    return false;
  mean_ = start.mean;
  detour_side_ = start.detour_side;
  return true;
}

PlanContext Mppi::context(const PlanInput& input) noexcept {
  PlanContext context;
  const Eigen::Vector3d& p = input.start.p_WB;
  const GateBelief& target = input.target;

  // Back around a missed gate on the side where the vehicle is; kept while it is near the middle, or it would dither
  // there.
  const Eigen::Vector3d beside = target.axis_W.cross(Eigen::Vector3d::UnitZ());
  const double offset_m = (p - target.center_W).dot(beside);
  if (std::abs(offset_m) > 0.4) detour_side_ = offset_m > 0 ? 1.0 : -1.0;

  const auto guidance = [&](const GateBelief& gate, double side) {
    return make_guidance(gate.center_W, gate.axis_W, profile_.funnel && !input.hold, profile_.funnel_half_angle_rad,
                         profile_.funnel_distance_m, gate_.outer_half_m, side);
  };
  context.target = guidance(target, detour_side_);
  context.has_next = input.has_next;
  if (input.has_next) {
    // Should the next gate's way in be on its far side, then around it on the side that is nearer.
    const Eigen::Vector3d across = input.next.axis_W.cross(Eigen::Vector3d::UnitZ());
    context.next = guidance(input.next, (target.center_W - input.next.center_W).dot(across) >= 0 ? 1.0 : -1.0);
  }
  context.has_left = input.has_left && (p - input.left.center_W).norm() < kLeftNear_m;
  if (context.has_left) context.left = guidance(input.left, 1.0);
  context.hold = input.hold;

  context.start_p_WB = p.cast<float>();
  context.start_along_m = context.target.along(context.start_p_WB.x(), context.start_p_WB.y(), context.start_p_WB.z());
  context.inner_half_m = static_cast<float>(gate_.inner_half_m);
  context.frame_width_m = static_cast<float>(gate_.outer_half_m - gate_.inner_half_m);
  context.cone_slope = cone_slope_;
  context.slab_half_m = static_cast<float>(0.5 * gate_.thickness_m + model_.collision_radius_m);

  // Near a gate that is not seen, or was seen long ago, more care.
  const double distance_m = (p - target.center_W).norm();
  double limit = input.speed_limit_m_s > 0 ? input.speed_limit_m_s : profile_.speed_limit_m_s;
  double extra_clearance_m = 0.0;
  if (input.hold) {
    limit = std::min(limit, std::max(0.5, 1.5 * std::sqrt(distance_m)));
  } else if (distance_m < profile_.near_m && !target.seen) {
    limit *= profile_.unseen_speed_factor;
  } else if (distance_m < profile_.near_m) {
    const double span_s = profile_.field_stale_s - profile_.field_fresh_s;
    const double stale = std::clamp((input.field_age_s - profile_.field_fresh_s) / span_s, 0.0, 1.0);
    limit *= 1.0 - stale * (1.0 - profile_.stale_speed_factor);
    extra_clearance_m = stale * profile_.stale_extra_clearance_m;
  }
  context.speed_limit_m_s = static_cast<float>(limit);
  context.crossing_need_m =
      static_cast<float>(model_.collision_radius_m + profile_.crossing_margin_m + extra_clearance_m);

  if (target.field != nullptr) {
    float s = 0.0f;
    const Eigen::Vector3f& p0 = context.start_p_WB;
    target.field->evaluate({&p0.x(), 1}, {&p0.y(), 1}, {&p0.z(), 1}, {&s, 1});
    context.start_clearance_m = s - std::abs(context.start_along_m) * cone_slope_;
  } else {
    const Eigen::Vector3d off = p - target.center_W;
    context.start_clearance_m =
        static_cast<float>(gate_.inner_half_m - (off - off.dot(target.axis_W) * target.axis_W).norm());
  }
  return context;
}

/// What a constant acceleration beyond the model does to positions and velocities; that drag then differs is left out.
void Mppi::add_disturbance(const Eigen::Vector3d& a_W, const RolloutBatch& batch) const noexcept {
  if (a_W.isZero(0.0)) return;
  for (int k = 0; k < batch.steps; ++k) {
    const double t_s = (k + 1) * profile_.step_s;
    for (int axis = 0; axis < 3; ++axis) {
      mppi::add(static_cast<float>(0.5 * t_s * t_s * a_W[axis]), batch.stride,
                batch.states.row(k, kernels::kPx + axis));
      mppi::add(static_cast<float>(t_s * a_W[axis]), batch.stride, batch.states.row(k, kernels::kVx + axis));
    }
  }
}

/// Samples and states of one block.
RolloutBatch Mppi::roll_out(const PlanInput& input, int block, Workspace& work) noexcept {
  const kernels::SampleBlock inputs = inputs_of(block);
  RolloutBatch batch;
  batch.states = {work.states.data(), profile_.steps, kernels::kStateChannels, inputs.samples, kBlock};
  batch.steps = profile_.steps;
  batch.samples = inputs.samples;
  batch.stride = kBlock;
  kernels::sample(noise_, seed_, input.step, block * kBlock, flat_mean_.data(), inputs);
  if (profile_.noise_correlation > 0) {
    const auto keep = static_cast<float>(profile_.noise_correlation);
    mppi::correlate(flat_mean_.data(), keep, std::sqrt(1.0f - keep * keep), profile_.steps, kBlock, inputs.data);
  }
  kernels::rollout(model_, input.start, profile_.step_s, inputs, batch.states);
  add_disturbance(input.disturbance_W_m_s2, batch);
  return batch;
}

void decode(const Field& field, const RolloutBatch& batch, std::vector<float>& out) noexcept {
  const std::size_t count = static_cast<std::size_t>(batch.stride);
  for (int k = 0; k < batch.steps; ++k) {
    const kernels::SampleBlock& states = batch.states;
    field.evaluate({states.row(k, kernels::kPx), count}, {states.row(k, kernels::kPy), count},
                   {states.row(k, kernels::kPz), count}, {out.data() + static_cast<std::size_t>(k) * count, count});
  }
}

bool any_passed(const RolloutBatch& batch) noexcept {
  const float* last = batch.passed_row(batch.steps - 1);
  return std::any_of(last, last + batch.stride, [](float passed) { return passed > 0.5f; });
}

/// Fields and what follows from them. @pre the batch has its states
void look_at_fields(const PlanInput& input, const PlanContext& context, bool fields_wanted, Workspace& work,
                    RolloutBatch* batch) noexcept {
  if (fields_wanted && input.target.field != nullptr && !input.hold) {
    decode(*input.target.field, *batch, work.field);
    batch->field = work.field.data();
  }
  annotate(context, batch->states, batch->field, work.along.data(), work.passed.data(), work.clearance.data(),
           work.crossing.data());
  batch->along = work.along.data();
  batch->passed = work.passed.data();
  batch->crossing_clearance = work.crossing.data();
  // The next gate's field matters only where a rollout has passed the target.
  if (fields_wanted && input.has_next && input.next.field != nullptr && any_passed(*batch)) {
    decode(*input.next.field, *batch, work.next_field);
    batch->next_field = work.next_field.data();
  }
}

/// The whole cost of each rollout of a block.
void Mppi::weigh_whole(const PlanInput& input, const PlanContext& context, int block, RolloutBatch batch,
                       Workspace& work, float* cost) noexcept {
  look_at_fields(input, context, fields_wanted(), work, &batch);
  std::fill_n(cost, kBlock, 0.0f);
  for (const auto& term : terms_) term->accumulate(context, batch, {cost, kBlock});
  if (input.observer != nullptr) input.observer->see(batch, block * kBlock);
}

/// What the terms that don't use the field say, for both answers to whether a rollout that crosses the gate's plane
/// passes the opening. Where there are more than two answers, the block is weighed whole.
void Mppi::weigh_without_field(const PlanInput& input, const PlanContext& context, int block) noexcept {
  Workspace& work = workspace();
  RolloutBatch batch = roll_out(input, block, work);
  const std::size_t first = static_cast<std::size_t>(block) * kBlock;

  PlanContext open = context;
  open.start_clearance_m = kOpen_m;
  annotate(open, batch.states, work.open.data(), work.along.data(), work.passed.data(), work.clearance.data(),
           work.crossing.data());
  batch.along = work.along.data();
  const float* last = work.passed.data() + (steps_ - 1) * kBlock;
  bool crosses = false, returns = false;
  for (std::size_t m = 0; m < kBlock; ++m) crosses |= last[m] > 0.5f;
  if (crosses) {
    for (std::size_t i = 0; i < steps_ * kBlock; ++i) returns |= work.passed[i] > 0.5f && work.along[i] < 0.0f;
  }
  if (returns) {
    weigh_whole(input, context, block, batch, work, cost_.data() + first);
    std::fill_n(known_.begin() + static_cast<std::ptrdiff_t>(first), kBlock, Known::kWhole);
    scouts_[static_cast<std::size_t>(block)] = -1;
    return;
  }

  float* const positions = positions_.data() + first * steps_ * 3;
  for (int k = 0; k < batch.steps; ++k)
    std::copy_n(batch.states.row(k, kernels::kPx), 3 * kBlock, positions + static_cast<std::size_t>(k) * 3 * kBlock);

  std::fill_n(work.crossing.data(), kBlock, kNoCrossing);
  batch.crossing_clearance = work.crossing.data();
  batch.passed = work.zeros.data();
  const auto weigh = [&](float* cost) {
    std::fill_n(cost, kBlock, 0.0f);
    for (std::size_t i = 0; i < free_terms_; ++i) terms_[i]->accumulate(context, batch, {cost, kBlock});
  };
  weigh(before_.data() + first);
  if (crosses) {
    batch.passed = work.passed.data();
    weigh(beyond_.data() + first);
  }
  std::size_t best = first;
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t m = first; m < first + static_cast<std::size_t>(samples_in(block)); ++m) {
    known_[m] = last[m - first] > 0.5f ? Known::kCrossing : Known::kBounded;
    if (const float L = bound(m); L < least) {
      least = L;
      best = m;
    }
  }
  scouts_[static_cast<std::size_t>(block)] = static_cast<int>(best);
}

/// Whole costs of some rollouts, from what weigh_without_field() left of them. @pre 0 < count <= kBlock
void Mppi::weigh_chosen(const PlanInput& input, const PlanContext& context, const int* chosen, int count) noexcept {
  Workspace& work = workspace();
  RolloutBatch batch;
  batch.steps = profile_.steps;
  batch.samples = count;
  batch.stride = kernels::padded_samples(count);
  batch.states = {work.states.data(), profile_.steps, 3, count, batch.stride};
  int at[kBlock];
  for (int i = 0; i < batch.stride; ++i) {
    const int m = chosen[std::min(i, count - 1)];
    at[i] = m / kBlock * kBlock * profile_.steps * 3 + m % kBlock;
  }
  for (int row = 0; row < 3 * profile_.steps; ++row)
    mppi::gather(positions_.data() + row * kBlock, at, batch.stride, batch.states.row(0, row));

  look_at_fields(input, context, fields_wanted(), work, &batch);
  const float* passed = batch.passed_row(batch.steps - 1);
  for (int i = 0; i < batch.stride; ++i) {
    const auto m = static_cast<std::size_t>(chosen[std::min(i, count - 1)]);
    work.cost[static_cast<std::size_t>(i)] = passed[i] > 0.5f ? beyond_[m] : before_[m];
  }
  for (std::size_t i = free_terms_; i < terms_.size(); ++i)
    terms_[i]->accumulate(context, batch, {work.cost.data(), static_cast<std::size_t>(batch.stride)});
  for (int i = 0; i < count; ++i) {
    const auto m = static_cast<std::size_t>(chosen[i]);
    cost_[m] = work.cost[static_cast<std::size_t>(i)];
    known_[m] = Known::kWhole;
  }
}

/// Whole costs of all rollouts that may get weight, infinity for the others. @return for how many the field was asked
int Mppi::weigh_hopeful(const PlanInput& input, const PlanContext& context) noexcept {
  share(blocks_, [&](int block) { weigh_without_field(input, context, block); });
  const std::size_t samples = static_cast<std::size_t>(profile_.samples);

  int scouts = 0;
  for (const int m : scouts_)
    if (m >= 0) chosen_[static_cast<std::size_t>(scouts++)] = m;
  const auto weigh = [&](int first, int count, int at_once) {
    share((count + at_once - 1) / at_once, [&, first, count, at_once](int i) {
      weigh_chosen(input, context, chosen_.data() + first + i * at_once, std::min(at_once, count - i * at_once));
    });
  };
  int asked = 0;
  weigh(0, scouts, kScouts);

  float best = std::numeric_limits<float>::infinity();
  for (std::size_t m = 0; m < samples; ++m) {
    if (known_[m] != Known::kWhole) continue;
    ++asked;
    best = std::min(best, cost_[m]);  // NaN never is the lesser
  }
  const double margin = profile_.temperature * (20.0 + std::log(static_cast<double>(samples)));
  const float limit = std::nextafter(static_cast<float>(best + margin), std::numeric_limits<float>::infinity());

  // Those that cross the plane come last: the next gate's field is asked for whole blocks of them.
  int hopeful = 0, crossing = 0;
  for (std::size_t m = 0; m < samples; ++m) {
    if (known_[m] == Known::kWhole) continue;
    cost_[m] = std::numeric_limits<float>::infinity();
    if (!(bound(m) <= limit)) continue;
    if (known_[m] == Known::kBounded)
      chosen_[static_cast<std::size_t>(hopeful++)] = static_cast<int>(m);
    else
      chosen_[samples - 1 - static_cast<std::size_t>(crossing++)] = static_cast<int>(m);
  }
  // Costs don't depend on which rollouts share a block, so threads get equal parts.
  const int total = hopeful + crossing;
  std::copy_n(chosen_.begin() + static_cast<std::ptrdiff_t>(samples) - crossing, crossing, chosen_.begin() + hopeful);
  weigh(0, total, total > 8 * kBlock ? kBlock : kBlock / 2);
  return asked + total;
}

/// mean_ = the samples' weighted average, block by block and the blocks' sums in their order.
void Mppi::average() noexcept {
  const std::size_t inputs = steps_ * kernels::kInputs;
  share(blocks_, [&](int block) {
    double* const sum = sums_.data() + static_cast<std::size_t>(block) * inputs;
    std::fill_n(sum, inputs, 0.0);
    const float* weight = weight_.data() + static_cast<std::size_t>(block) * kBlock;
    const auto count = static_cast<std::size_t>(samples_in(block));
    if (std::all_of(weight, weight + count, [](float w) { return w == 0.0f; })) return;
    kernels::accumulate_average({weight, count}, inputs_of(block), sum);
  });
  for (std::size_t i = 0; i < inputs; ++i) {
    double sum = 0.0;
    for (std::size_t block = 0; block < static_cast<std::size_t>(blocks_); ++block) sum += sums_[block * inputs + i];
    mean_[i / kernels::kInputs][static_cast<Eigen::Index>(i % kernels::kInputs)] = sum;
  }
}

void Mppi::plan(const PlanInput& input, Plan* plan) noexcept {
  shift_plan(input.elapsed_s, profile_.step_s, mean_);
  for (std::size_t k = 0; k < steps_; ++k)
    for (std::size_t i = 0; i < kernels::kInputs; ++i)
      flat_mean_[k * kernels::kInputs + i] = static_cast<float>(mean_[k][static_cast<Eigen::Index>(i)]);

  const PlanContext shared = context(input);
  const bool field_known = fields_wanted() && input.target.field != nullptr && !input.hold;
  const auto whole = [&](int block) {
    Workspace& work = workspace();
    weigh_whole(input, shared, block, roll_out(input, block, work), work,
                cost_.data() + static_cast<std::size_t>(block) * kBlock);
  };
  plan->decoded_rollouts = field_known ? profile_.samples : 0;
  if (input.observer != nullptr) {
    for (int block = 0; block < blocks_; ++block) whole(block);
  } else if (options_.leave_out && field_known) {
    plan->decoded_rollouts = weigh_hopeful(input, shared);
  } else {
    share(blocks_, whole);
  }

  const std::size_t samples = static_cast<std::size_t>(profile_.samples);
  const std::span<const float> cost(cost_.data(), samples);
  plan->temperature = profile_.temperature;
  if (profile_.target_effective_fraction > 0)
    plan->temperature =
        kernels::temperature_for(cost, profile_.target_effective_fraction * static_cast<double>(samples),
                                 profile_.temperature_min, profile_.temperature_max);
  plan->effective_samples = kernels::softmax_weights(cost, plan->temperature, {weight_.data(), samples});
  plan->ok = plan->effective_samples > 0;
  if (plan->ok) average();
  predict(input, plan);
}

void Mppi::predict(const PlanInput& input, Plan* plan) const noexcept {
  plan->steps = profile_.steps;
  QuadrotorState state = input.start;
  plan->lowest_field_m = 0.0;
  float x[kMaxSteps], y[kMaxSteps], z[kMaxSteps], s[kMaxSteps];
  const std::size_t steps = static_cast<std::size_t>(profile_.steps);
  for (std::size_t k = 0; k < steps; ++k) {
    const Eigen::Vector4d before = state.thrust_command_n;
    state = step_planner(model_, state, mean_[k], profile_.step_s);
    state.p_WB += 0.5 * profile_.step_s * profile_.step_s * input.disturbance_W_m_s2;
    state.v_WB += profile_.step_s * input.disturbance_W_m_s2;
    plan->thrust_rate_n_s[k] = (state.thrust_command_n - before) / profile_.step_s;
    plan->state[k] = state;
    x[k] = static_cast<float>(state.p_WB.x());
    y[k] = static_cast<float>(state.p_WB.y());
    z[k] = static_cast<float>(state.p_WB.z());
  }
  if (input.target.field != nullptr) {
    input.target.field->evaluate({x, steps}, {y, steps}, {z, steps}, {s, steps});
    plan->lowest_field_m = *std::min_element(s, s + steps);
  }
}

}  // namespace

Result<std::unique_ptr<Planner>> Planner::create(const Profile& profile, const QuadrotorModel& model,
                                                 const GateShape& gate, double cone_angle_rad, std::uint64_t seed,
                                                 const PlannerOptions& options) {
  if (Status status = validate(profile); !status) return Error{status.error()};
  if (Status status = gatefield::validate(model); !status) return Error{status.error()};
  if (Status status = gatefield::validate(gate); !status) return Error{status.error()};
  return std::unique_ptr<Planner>(std::make_unique<Mppi>(profile, model, gate, cone_angle_rad, seed, options));
}

void Planner::prepare_thread() { workspace(); }

}  // namespace gatefield::planner
