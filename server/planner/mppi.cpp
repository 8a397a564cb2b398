#include <algorithm>
#include <cmath>
#include <vector>

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
       std::uint64_t seed)
      : profile_(profile),
        model_(model),
        gate_(gate),
        seed_(seed),
        noise_(noise_shape(profile, model)),
        terms_(make_terms(profile)),
        mean_(static_cast<std::size_t>(profile.steps), ThrustRates::Zero()) {
    model_.thrust_rate_max_n_s = std::min(model.thrust_rate_max_n_s, profile.thrust_rate_limit_n_s);
    cone_slope_ = static_cast<float>(std::tan(cone_angle_rad));
    const std::size_t steps = static_cast<std::size_t>(profile.steps);
    const std::size_t rows = steps * kBlock;
    const std::size_t blocks = static_cast<std::size_t>((profile.samples + kBlock - 1) / kBlock);
    inputs_.resize(blocks * rows * kernels::kInputs);
    states_.resize(rows * kernels::kStateChannels);
    for (std::vector<float>* buffer : {&along_, &passed_, &clearance_, &field_, &next_field_}) buffer->resize(rows);
    crossing_.resize(kBlock);
    cost_.resize(blocks * kBlock);
    weight_.resize(blocks * kBlock);
    flat_mean_.resize(steps * kernels::kInputs);
    sum_.resize(steps * kernels::kInputs);
  }

  void plan(const PlanInput& input, Plan* plan) noexcept override;
  void reset() noexcept override { std::fill(mean_.begin(), mean_.end(), ThrustRates::Zero()); }
  const Profile& profile() const noexcept override { return profile_; }

 private:
  PlanContext context(const PlanInput& input) noexcept;
  void evaluate_block(const PlanInput& input, const PlanContext& context, int block) noexcept;
  void predict(const PlanInput& input, Plan* plan) const noexcept;

  int samples_in(int block) const noexcept { return std::min(kBlock, profile_.samples - block * kBlock); }
  kernels::SampleBlock inputs_of(int block) noexcept {
    const std::size_t size = static_cast<std::size_t>(profile_.steps) * kernels::kInputs * kBlock;
    return {inputs_.data() + static_cast<std::size_t>(block) * size, profile_.steps, kernels::kInputs,
            samples_in(block), kBlock};
  }

  Profile profile_;
  QuadrotorModel model_;
  GateShape gate_;
  std::uint64_t seed_;
  float cone_slope_ = 0.0f;
  kernels::NoiseShape noise_;
  std::vector<std::unique_ptr<const CostTerm>> terms_;
  std::vector<ThrustRates> mean_;  ///< U*, starts the next step
  double detour_side_ = 1.0;       ///< see context(): hysteresis of the way back around a missed gate

  // Scratch, sized once. Blocks keep their inputs until the average; everything else is reused by the next block.
  std::vector<float> inputs_, states_, along_, passed_, clearance_, field_, next_field_, crossing_, cost_, weight_,
      flat_mean_;
  std::vector<double> sum_;
};

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
  if (input.has_next) context.next = guidance(input.next, 1.0);
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

void Mppi::evaluate_block(const PlanInput& input, const PlanContext& context, int block) noexcept {
  const int steps = profile_.steps;
  const std::size_t rows = static_cast<std::size_t>(steps) * kBlock;
  const kernels::SampleBlock inputs = inputs_of(block);
  const kernels::SampleBlock states{states_.data(), steps, kernels::kStateChannels, inputs.samples, kBlock};
  kernels::sample(noise_, seed_, input.step, block * kBlock, flat_mean_.data(), inputs);
  kernels::rollout(model_, input.start, profile_.step_s, inputs, states);

  const bool fields_wanted = profile_.field_weight > 0 || profile_.crossing_weight > 0;
  const auto evaluate = [&](const Field* field, std::vector<float>& out) {
    for (int k = 0; k < steps; ++k) {
      const std::size_t count = kBlock;
      field->evaluate({states.row(k, kernels::kPx), count}, {states.row(k, kernels::kPy), count},
                      {states.row(k, kernels::kPz), count}, {out.data() + static_cast<std::size_t>(k) * kBlock, count});
    }
  };
  RolloutBatch batch;
  batch.states = states;
  batch.steps = steps;
  batch.samples = inputs.samples;
  batch.stride = kBlock;
  if (fields_wanted && input.target.field != nullptr && !input.hold) {
    evaluate(input.target.field, field_);
    batch.field = field_.data();
  }
  annotate(context, states, batch.field, along_.data(), passed_.data(), clearance_.data(), crossing_.data());
  batch.along = along_.data();
  batch.passed = passed_.data();
  batch.crossing_clearance = crossing_.data();
  // The next gate's field matters only where a rollout has passed the target.
  const float* passed_at_end = passed_.data() + rows - kBlock;
  const bool any_passed =
      std::any_of(passed_at_end, passed_at_end + kBlock, [](float passed) { return passed > 0.5f; });
  if (fields_wanted && any_passed && input.has_next && input.next.field != nullptr) {
    evaluate(input.next.field, next_field_);
    batch.next_field = next_field_.data();
  }

  const std::span<float> cost(cost_.data() + static_cast<std::size_t>(block) * kBlock, kBlock);
  std::fill(cost.begin(), cost.end(), 0.0f);
  for (const auto& term : terms_) term->accumulate(context, batch, cost);
}

void Mppi::plan(const PlanInput& input, Plan* plan) noexcept {
  const std::size_t steps = static_cast<std::size_t>(profile_.steps);
  shift_plan(input.elapsed_s, profile_.step_s, mean_);
  for (std::size_t k = 0; k < steps; ++k)
    for (std::size_t i = 0; i < kernels::kInputs; ++i)
      flat_mean_[k * kernels::kInputs + i] = static_cast<float>(mean_[k][static_cast<Eigen::Index>(i)]);

  const PlanContext shared = context(input);
  const int blocks = (profile_.samples + kBlock - 1) / kBlock;
  for (int block = 0; block < blocks; ++block) evaluate_block(input, shared, block);

  const std::size_t samples = static_cast<std::size_t>(profile_.samples);
  const std::span<const float> cost(cost_.data(), samples);
  plan->temperature = profile_.temperature;
  if (profile_.target_effective_fraction > 0)
    plan->temperature =
        kernels::temperature_for(cost, profile_.target_effective_fraction * static_cast<double>(samples),
                                 profile_.temperature_min, profile_.temperature_max);
  plan->effective_samples = kernels::softmax_weights(cost, plan->temperature, {weight_.data(), samples});
  plan->ok = plan->effective_samples > 0;
  if (plan->ok) {
    std::fill(sum_.begin(), sum_.end(), 0.0);
    for (int block = 0; block < blocks; ++block) {
      const std::size_t count = static_cast<std::size_t>(samples_in(block));
      kernels::accumulate_average({weight_.data() + static_cast<std::size_t>(block) * kBlock, count}, inputs_of(block),
                                  sum_.data());
    }
    for (std::size_t k = 0; k < steps; ++k)
      for (std::size_t i = 0; i < kernels::kInputs; ++i)
        mean_[k][static_cast<Eigen::Index>(i)] = sum_[k * kernels::kInputs + i];
  }
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
                                                 const GateShape& gate, double cone_angle_rad, std::uint64_t seed) {
  if (Status status = validate(profile); !status) return Error{status.error()};
  if (Status status = gatefield::validate(model); !status) return Error{status.error()};
  if (Status status = gatefield::validate(gate); !status) return Error{status.error()};
  return std::unique_ptr<Planner>(std::make_unique<Mppi>(profile, model, gate, cone_angle_rad, seed));
}

}  // namespace gatefield::planner
