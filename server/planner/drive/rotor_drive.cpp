#include <algorithm>
#include <array>
#include <cmath>

#include "server/planner/drive/drive.h"
#include "server/planner/warm_start.h"

namespace gatefield::planner {
namespace {

/// Spread of each rotor's thrust rate for collective, roll, pitch and yaw alone, N/s.
std::array<float, kRotors> noise_sigma_n_s(const Profile& profile, const QuadrotorModel& model) {
  double roll_arms_m = 0.0, pitch_arms_m = 0.0;
  for (const Eigen::Vector2d& position_m : model.rotor_position_B_m) {
    roll_arms_m += std::abs(position_m.y());
    pitch_arms_m += std::abs(position_m.x());
  }
  const Eigen::Vector3d torque_nm_s = Eigen::Vector3d(profile.rotors_tilt_sigma_rad_s3,
                                                      profile.rotors_tilt_sigma_rad_s3, profile.rotors_yaw_sigma_rad_s3)
                                          .cwiseProduct(model.inertia_kg_m2);
  return {static_cast<float>(profile.rotors_thrust_sigma_s * model.mass_kg * kGravity_m_s2 / kRotors),
          static_cast<float>(torque_nm_s.x() / roll_arms_m), static_cast<float>(torque_nm_s.y() / pitch_arms_m),
          static_cast<float>(torque_nm_s.z() / (kRotors * model.torque_per_thrust_m))};
}

/// Inputs are dT/dt of each rotor's commanded thrust, N/s (the paper's).
class RotorDrive final : public Drive {
 public:
  RotorDrive(const Profile& profile, const QuadrotorModel& model)
      : model_(model), step_s_(profile.step_s), noise_correlation_(profile.rotors_correlation) {
    const double hover_n = model.mass_kg * kGravity_m_s2 / kRotors;
    model_.thrust_rate_max_n_s = std::min(model.thrust_rate_max_n_s, profile.rotors_change_limit_s * hover_n);
    noise_.sigma = noise_sigma_n_s(profile, model);
    // Signs of collective, roll, pitch and yaw on each rotor, from where the rotors are and how they turn.
    for (std::size_t i = 0; i < kRotors; ++i) {
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
