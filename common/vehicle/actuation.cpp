#include "common/vehicle/actuation.h"

#include <cmath>
#include <string>

#include "common/base/text.h"

namespace gatefield {
namespace {

Status check_lag(const std::string& field, double lag_s, bool wanted) {
  if (!wanted)
    return lag_s == 0.0 ? Status{}
                        : Error::invalid(field, text(lag_s) + " s", "0 for a vehicle driven by rotor thrusts");
  if (lag_s >= 0.001 && lag_s <= 1.0) return {};
  return Error::invalid(field, text(lag_s) + " s", "0.001 to 1 s");
}

struct Followed {
  double end;
  double mean;
};
/// What is `x` now and follows a command from `begin` to `end` during dt with a first-order lag.
Followed follow(double x, double begin, double end, double lag_s, double dt_s) noexcept {
  const double behind_ramp = (end - begin) / dt_s * lag_s;
  const double behind = x - begin + behind_ramp;
  return {end - behind_ramp + behind * std::exp(-dt_s / lag_s),
          0.5 * (begin + end) - behind_ramp - behind * std::expm1(-dt_s / lag_s) * lag_s / dt_s};
}

}  // namespace

Status validate(const Actuation& actuation) {
  if (actuation.kind != Actuation::Kind::kRotorThrusts && actuation.kind != Actuation::Kind::kBodyRates)
    return Error::invalid("actuation.kind", text(static_cast<int>(actuation.kind)),
                          "0 (rotor thrusts) or 1 (collective thrust and body rates)");
  const bool rates = actuation.kind == Actuation::Kind::kBodyRates;
  if (auto s = check_lag("actuation.thrust_time_constant_s", actuation.thrust_time_constant_s, rates); !s) return s;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (auto s = check_lag("actuation.rate_time_constant_s[" + text(i) + "]", actuation.rate_time_constant_s[i], rates);
        !s)
      return s;
  return {};
}

RateCommand hover_command(const QuadrotorModel& model) { return {model.mass_kg * kGravity_m_s2, 0.0, 0.0, 0.0}; }

QuadrotorState step_body_rates(const QuadrotorModel& model, const Actuation& actuation, const QuadrotorState& state,
                               const RateCommand& begin, const RateCommand& end, double dt_s,
                               double thrust_factor) noexcept {
  const Followed thrust = follow(state.thrust_n.sum(), begin[0], end[0], actuation.thrust_time_constant_s, dt_s);
  QuadrotorState next = state;
  next.thrust_n.setConstant(thrust.end / kRotors);
  next.thrust_command_n.setConstant(end[0] / kRotors);
  Eigen::Vector3d mean_w;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Followed rate = follow(state.w_WB_B[i], begin[i + 1], end[i + 1], actuation.rate_time_constant_s[i], dt_s);
    next.w_WB_B[i] = rate.end;
    mean_w[i] = rate.mean;
  }
  move_body(model, state, mean_w, thrust_factor * thrust.mean, dt_s, &next);
  return next;
}

}  // namespace gatefield
