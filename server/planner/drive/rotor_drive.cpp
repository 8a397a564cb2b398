#include <algorithm>

#include "server/planner/drive/drive.h"
#include "server/planner/warm_start.h"

namespace gatefield::planner {
namespace {

/// Inputs are dT/dt of each rotor's commanded thrust, N/s (the paper's).
class RotorDrive final : public Drive {
 public:
  RotorDrive(const Profile& profile, const QuadrotorModel& model)
      : model_(model), step_s_(profile.step_s), noise_correlation_(profile.noise_correlation) {
    model_.thrust_rate_max_n_s = std::min(model.thrust_rate_max_n_s, profile.thrust_rate_limit_n_s);
    // Signs of collective, roll, pitch and yaw on each rotor, from where the rotors are and how they turn.
    for (std::size_t i = 0; i < kRotors; ++i) {
      noise_.sigma[i] = static_cast<float>(profile.noise_sigma_n_s[i]);
      const Eigen::Vector2d& position = model.rotor_position_B_m[i];
      noise_.mixer[i] = {1.0f, position.y() >= 0 ? 1.0f : -1.0f, position.x() >= 0 ? -1.0f : 1.0f,
                         model.rotor_spin[i] >= 0 ? 1.0f : -1.0f};
    }
  }

  kernels::NoiseShape noise() const noexcept override { return noise_; }
  double noise_correlation() const noexcept override { return noise_correlation_; }
  PlainVector4 still() const noexcept override { return PlainVector4::Zero(); }

  void begin(const PlanInput& input, std::span<PlainVector4> mean) noexcept override {
    shift_plan(input.elapsed_s, step_s_, still(), mean);
  }
  void roll_out(const kernels::Backend& backend, const PlanInput& input, kernels::SampleBlock inputs,
                kernels::SampleBlock states) const noexcept override {
    backend.rollout(model_, input.start, step_s_, inputs, states);
  }
  DrivenState start(const PlanInput& input) const noexcept override { return {input.start, RateCommand::Zero()}; }
  void move(const PlanInput& /*input*/, const PlainVector4& mean, std::size_t k, DrivenState* state,
            Plan* plan) const noexcept override {
    const Eigen::Vector4d before = state->body.thrust_command_n;
    state->body = step_planner(model_, state->body, mean, step_s_);
    plan->thrust_rate_n_s[k] = (state->body.thrust_command_n - before) / step_s_;
    plan->rate_command[k].setZero();
  }

 private:
  QuadrotorModel model_;  ///< its thrust rate bounded by the profile's
  double step_s_;
  double noise_correlation_;
  kernels::NoiseShape noise_;
};

}  // namespace

std::unique_ptr<Drive> make_rotor_drive(const Profile& profile, const QuadrotorModel& model) {
  return std::make_unique<RotorDrive>(profile, model);
}

}  // namespace gatefield::planner
