#include "server/service/costs.h"

#include <algorithm>

namespace gatefield::service {
namespace {

// Of what is new, at each learning (four a second).
constexpr double kRise = 0.3;
constexpr double kFall = 0.03;

void learn(double* known, double value) {
  if (*known <= 0.0)
    *known = value;
  else
    *known += (value > *known ? kRise : kFall) * (value - *known);
}

double size_of(const planner::Profile& profile) {
  return std::max(1.0, static_cast<double>(profile.samples) * profile.steps);
}

}  // namespace

void Costs::learn_step(const planner::Profile& profile, std::chrono::nanoseconds step) {
  learn(&rollout_step_s_[profile.name], seconds(step) / size_of(profile));
}

void Costs::learn_look(std::chrono::nanoseconds look) { learn(&look_s_, seconds(look)); }

void Costs::learn_other(double cores) { learn(&other_cores_, std::clamp(cores, 1e-3, 5 * kUsualOther_cores)); }

Need Costs::of(const planner::Profile& profile, double camera_rate_hz) const {
  double rollout_step_s = 0.0;
  if (const auto found = rollout_step_s_.find(profile.name); found != rollout_step_s_.end())
    rollout_step_s = found->second;
  else  // the dearest one known: a stranger is better thought too dear than too cheap
    for (const auto& [name, known_s] : rollout_step_s_) rollout_step_s = std::max(rollout_step_s, known_s);
  return {rollout_step_s * size_of(profile) * profile.control_rate_hz, look_s_ * camera_rate_hz, other_cores_};
}

}  // namespace gatefield::service
