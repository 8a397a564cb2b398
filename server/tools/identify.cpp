#include "server/tools/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "server/pilot/drive_watch.h"
#include "server/pilot/predictor.h"

namespace gatefield::tools {
namespace {

constexpr Stamp kLongestGap = std::chrono::milliseconds(100);

/// 0 when there are none.
double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// What was known at each moment, of one kind of number.
struct Found {
  std::vector<double> values;
  void add(double value) {
    if (value > 0.0) values.push_back(value);
  }
};

void set_thrust(double collective_n, QuadrotorState* state) {
  state->thrust_n.setConstant(collective_n / kRotors);
  state->thrust_command_n = state->thrust_n;
}

/// One run through a recording.
/// @param limit_rad_s  where the vehicle clamps its command, about x, y, z of B; 0: nowhere, or not known
Identified run(std::span<const RecordedState> recording, const QuadrotorModel& model, const Actuation& told,
               const Eigen::Vector3d& asked_at_most_rad_s, const Eigen::Vector3d& limit_rad_s) {
  pilot::DriveWatch watch(told, asked_at_most_rad_s);
  pilot::ThrustFactor thrust;
  Identified out;
  Found factors;
  std::array<Found, 3> lags_s, limits_rad_s;
  double thrust_n = hover_command(model)[0];
  for (std::size_t i = 0; i + 1 < recording.size(); ++i) {
    const RecordedState &now = recording[i], &next = recording[i + 1];
    const Stamp dt = next.stamp - now.stamp;
    if (dt > kLongestGap) {
      watch.interrupt(next.state.w_WB_B);
      thrust_n = next.asked[0];
      continue;
    }
    RateCommand taken = now.asked;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (limit_rad_s[axis] > 0.0) taken[axis + 1] = std::clamp(taken[axis + 1], -limit_rad_s[axis], limit_rad_s[axis]);
    QuadrotorState begin = now.state;
    set_thrust(thrust_n, &begin);
    pilot::InputTimeline asked;
    asked.tell(now.stamp, now.stamp, {protocol::AskedBy::kOther, taken});
    QuadrotorState predicted = begin;
    pilot::predict({model, told, thrust.value()}, asked, now.stamp, next.stamp, Eigen::Vector3d::Zero(), &predicted);
    thrust.observe(begin, predicted, next.state.v_WB, model.mass_kg, dt);
    watch.follow(taken, dt);
    watch.observe(next.state.w_WB_B, dt);
    thrust_n = predicted.thrust_n.sum();
    out.flown_s += seconds(dt);

    protocol::IdentifiedDrive known;
    watch.fill(thrust, &known);
    factors.add(known.thrust_factor);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lags_s[axis].add(known.rate_time_constant_s[static_cast<Eigen::Index>(axis)]);
      limits_rad_s[axis].add(known.rate_limit_rad_s[static_cast<Eigen::Index>(axis)]);
    }
  }
  out.drive.thrust_factor = median(factors.values);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out.drive.rate_time_constant_s[static_cast<Eigen::Index>(axis)] = median(lags_s[axis].values);
    out.drive.rate_limit_rad_s[static_cast<Eigen::Index>(axis)] = median(limits_rad_s[axis].values);
  }
  return out;
}

}  // namespace

Identified identify(std::span<const RecordedState> recording, const QuadrotorModel& model, const Actuation& told,
                    const Eigen::Vector3d& asked_at_most_rad_s) {
  Identified found = run(recording, model, told, asked_at_most_rad_s, Eigen::Vector3d::Zero());
  const Eigen::Vector3d limit_rad_s = found.drive.rate_limit_rad_s;
  if (limit_rad_s.isZero(0.0)) return found;
  // Until a limit is met often enough to be known, it looks like a slower loop.
  found = run(recording, model, told, asked_at_most_rad_s, limit_rad_s);
  found.drive.rate_limit_rad_s = limit_rad_s;
  return found;
}

std::string vehicle_lines(const Identified& identified, const QuadrotorModel& model, const Actuation& told) {
  const protocol::IdentifiedDrive& found = identified.drive;
  constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};
  std::string out;
  if (found.thrust_factor > 0.0) {
    out += fmt::format(
        "# thrust: {:.3f} of what was asked for. Mend the thrust curve (throttle for a thrust), or, where that is "
        "right, "
        "in quadrotor {{ }}:\n#   mass_kg: {:.4g}\n",
        found.thrust_factor, model.mass_kg / found.thrust_factor);
  } else {
    out += "# thrust: not known, too little was flown\n";
  }
  if (found.rate_limit_rad_s.maxCoeff() > 0.0) {
    out += "# in quadrotor { }; 0 where no limit was met\nbody_rate_max_rad_s {";
    for (Eigen::Index i = 0; i < 3; ++i)
      out += fmt::format(" {}: {:.3g}", kAxes[static_cast<std::size_t>(i)],
                         found.rate_limit_rad_s[i] > 0.0 ? found.rate_limit_rad_s[i] : model.body_rate_max_rad_s[i]);
    out += " }\n";
  } else {
    out += "# limits of body rates: none was met\n";
  }
  std::string as_told, lags;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const char* const axis = kAxes[static_cast<std::size_t>(i)];
    const bool known = found.rate_time_constant_s[i] > 0.0;
    if (!known) as_told += std::string(as_told.empty() ? "  # as told, it hardly turned: " : ", ") + axis;
    lags +=
        fmt::format(" {}: {:.4f}", axis,
                    known ? found.rate_time_constant_s[i] / pilot::RateLags::kOfStep : told.rate_time_constant_s[i]);
  }
  return out +
         fmt::format(
             "actuation {{\n  kind: BODY_RATES\n  thrust_time_constant_s: {:.4g}  # as told\n  rate_time_constant_s "
             "{{{} }}{}\n}}\n",
             told.thrust_time_constant_s, lags, as_told);
}

}  // namespace gatefield::tools
