#pragma once

#include <map>
#include <string>

#include "common/base/clock.h"
#include "server/planner/profile.h"

namespace gatefield::service {

/// What a vehicle takes, or all of them, cores: 0.5 is half of one core's time.
struct Need {
  double control = 0.0;     ///< control steps, with what helpers do of them
  double perception = 0.0;  ///< looks at depth frames
  double other = 0.0;       ///< the middleware's threads, housekeeping

  double all() const noexcept { return control + perception + other; }
  Need& operator+=(const Need& more) noexcept {
    control += more.control;
    perception += more.perception;
    other += more.other;
    return *this;
  }
};

/// What vehicles cost, learned from processor time: first from a trial at the server's start (trial.h), then from the
/// steps themselves. A step's time is kept per rollout and step of the horizon, so that a profile that nobody has flown
/// yet, or that was read anew with other numbers, has a price, too.
/// More is believed within a second or two, less over ten seconds: who joins is judged by what the dear steps of late
/// cost, not by those of a vehicle that sees no gate yet.
/// Thread-safe: no (housekeeping).
class Costs {
 public:
  /// Of the middleware, for each vehicle, while nothing is known: states, frames and commands at usual rates.
  static constexpr double kUsualOther_cores = 0.02;

  /// @param step   processor time of a control step, all threads together
  void learn_step(const planner::Profile& profile, std::chrono::nanoseconds step);
  /// @param look  processor time of a look at a depth frame
  void learn_look(std::chrono::nanoseconds look);
  /// @param cores  what is neither control nor perception, for each vehicle
  void learn_other(double cores);

  /// What a vehicle of this profile takes in real time. 0 for control and perception while nothing was learned at all.
  Need of(const planner::Profile& profile, double camera_rate_hz) const;

 private:
  std::map<std::string, double> rollout_step_s_;  // by profile
  double look_s_ = 0.0;
  double other_cores_ = kUsualOther_cores;
};

}  // namespace gatefield::service
