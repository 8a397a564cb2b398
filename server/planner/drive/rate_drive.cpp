#include <algorithm>

#include "server/planner/drive/drive.h"
#include "server/planner/warm_start.h"

namespace gatefield::planner {
namespace {

/// Inputs are what a flight controller is asked for, collective thrust (N) and body rates (rad/s), each holding for a
/// step; or, where the profile wants that, their changes per second, along which what is asked for runs.
///
/// The rollouts' model of the rate loop has no torque of its own, so the mixer has to be left some: what is asked for
/// keeps between parts of the total thrust (rates_thrust_low, rates_thrust_high), as far as they leave room around the
/// hover.
class RateDrive final : public Drive {
 public:
  RateDrive(const Profile& profile, const QuadrotorModel& model, const Actuation& actuation)
      : step_s_(profile.step_s), noise_correlation_(profile.rates_correlation), still_(hover_command(model)) {
    how_.model = model;
    how_.actuation = actuation;
    how_.inputs = profile.rates_by_changes ? kernels::RateInputs::kChanges : kernels::RateInputs::kCommands;
    const double hover_n = still_[0];
    const double least_n = kRotors * model.thrust_min_n, most_n = kRotors * model.thrust_max_n;
    how_.low[0] = std::max(least_n, std::min(profile.rates_thrust_low * most_n, 0.5 * (least_n + hover_n)));
    how_.high[0] = std::min(most_n, std::max(profile.rates_thrust_high * most_n, 0.5 * (most_n + hover_n)));
    how_.high.tail<3>() = body_rate_limits_rad_s(profile, model);
    how_.low.tail<3>() = -how_.high.tail<3>();
    const auto f = [](double value) { return static_cast<float>(value); };
    noise_.mixer = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    if (changes()) {
      const float tilt = f(profile.rates_tilt_change_sigma_rad_s2);
      noise_.sigma = {f(profile.rates_thrust_change_sigma_s * hover_n), tilt, tilt,
                      f(profile.rates_yaw_change_sigma_rad_s2)};
      noise_correlation_ = 0.0;
      still_.setZero();
    } else {
      const float tilt = f(profile.rates_tilt_sigma_rad_s);
      noise_.sigma = {f(profile.rates_thrust_sigma * hover_n), tilt, tilt, f(profile.rates_yaw_sigma_rad_s)};
    }
  }

  kernels::NoiseShape noise() const noexcept override { return noise_; }
  double noise_correlation() const noexcept override { return noise_correlation_; }
  PlainVector4 still() const noexcept override { return still_; }

  /// Commands hold their last value beyond the old plan's end. Of changes, what is asked for goes on from where the old
  /// plan's own line has come to: what was sent holds for a step at a time and is up to half a step beside it.
  /// After an outage longer than the old plan nothing of it is left.
  void begin(const PlanInput& input, std::span<PlainVector4> mean) noexcept override {
    if (!(input.elapsed_s < step_s_ * static_cast<double>(mean.size()))) {
      std::fill(mean.begin(), mean.end(), still_);
      asked_ = input.asked;
      return;
    }
    if (!changes()) {
      shift_plan(input.elapsed_s, step_s_, mean.back(), mean);
      asked_ = input.asked;
      return;
    }
    if (input.elapsed_s > 0.0) {
      double left_s = input.elapsed_s;
      for (std::size_t k = 0; k < mean.size() && left_s > 0.0; ++k) {
        asked_ = kernels::bounded(how_, asked_ + std::min(left_s, step_s_) * mean[k]);
        left_s -= step_s_;
      }
      shift_plan(input.elapsed_s, step_s_, still_, mean);
    } else {
      asked_ = input.asked;
    }
  }
  void roll_out(const kernels::Backend& backend, const PlanInput& input, kernels::SampleBlock inputs,
                kernels::SampleBlock states) const noexcept override {
    kernels::RateRollout how = how_;
    how.thrust_factor = input.thrust_factor;
    backend.rollout_rates(how, input.start, asked_, step_s_, inputs, states);
  }
  DrivenState start(const PlanInput& input) const noexcept override {
    return {input.start, kernels::bounded(how_, asked_)};
  }
  void move(const PlanInput& input, const PlainVector4& mean, std::size_t k, DrivenState* state,
            Plan* plan) const noexcept override {
    const RateCommand end = kernels::bounded(how_, changes() ? RateCommand(state->asked + step_s_ * mean) : mean);
    const RateCommand begin = changes() ? state->asked : end;
    state->body = step_body_rates(how_.model, how_.actuation, state->body, begin, end, step_s_, input.thrust_factor);
    state->asked = end;
    plan->rate_command[k] = 0.5 * (begin + end);
    plan->thrust_rate_n_s[k].setZero();
  }

  RateCommand asked() const noexcept override { return asked_; }
  void restore(const RateCommand& asked) noexcept override { asked_ = asked; }

 private:
  bool changes() const noexcept { return how_.inputs == kernels::RateInputs::kChanges; }

  double step_s_;
  double noise_correlation_;
  PlainVector4 still_;
  kernels::RateRollout how_;
  kernels::NoiseShape noise_;
  RateCommand asked_ = RateCommand::Zero();
};

}  // namespace

Eigen::Vector3d body_rate_limits_rad_s(const Profile& profile, const QuadrotorModel& model) noexcept {
  Eigen::Vector3d limits(profile.rates_tilt_limit_rad_s, profile.rates_tilt_limit_rad_s, profile.rates_yaw_limit_rad_s);
  for (Eigen::Index i = 0; i < 3; ++i)
    if (model.body_rate_max_rad_s[i] > 0.0) limits[i] = std::min(limits[i], model.body_rate_max_rad_s[i]);
  return limits;
}

std::unique_ptr<Drive> make_rate_drive(const Profile& profile, const QuadrotorModel& model,
                                       const Actuation& actuation) {
  return std::make_unique<RateDrive>(profile, model, actuation);
}

}  // namespace gatefield::planner
