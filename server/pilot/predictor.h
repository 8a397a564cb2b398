#pragma once

#include <chrono>

#include "common/base/clock.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "server/pilot/input_timeline.h"

/// From a state that was true a moment ago to the state in which the next plan begins.
namespace gatefield::pilot {

/// What moves a vehicle, as prediction knows it.
struct Dynamics {
  QuadrotorModel model = {};
  Actuation actuation = {};
  double thrust_factor = 1.0;  ///< by body rates: real thrust over what it is thought to be
};

/// Moves a state from one stamp to another through what was sent, in steps of at most 10 ms of the reference dynamics
/// (step_reference; by body rates step_body_rates), so that the prediction's own error is far below the model's.
/// @param disturbance_W_m_s2  acceleration beyond the model's, constant meanwhile
/// Thread-safe: yes.   Real-time safe: yes (bounded: one step per 10 ms and per piece).
void predict(const Dynamics& dynamics, const InputTimeline& inputs, Stamp from, Stamp to,
             const Eigen::Vector3d& disturbance_W_m_s2, QuadrotorState* state) noexcept;

/// The same for the thrust alone: thrust_n and thrust_command_n, for vehicles that can't measure it.
void predict_rotors(const Dynamics& dynamics, const InputTimeline& inputs, Stamp from, Stamp to,
                    QuadrotorState* state) noexcept;

/// How long it takes from now until a plan that is begun now can begin to hold at the vehicle.
///
/// The client measures from sending a state to receiving the command that answers it. Of that, the server knows what
/// passed in its own house (from receiving the state to sending the command); the rest is the network, there and back.
/// So, with exponential means (a quarter of weight for each new value at first, a tenth later):
///   network = mean(round trip) - mean(residence),   solve = mean + 2 mean deviations,
///   ahead() = network + solve, held within [0, kMaxDelay].
/// The state's age since it was received comes on top; the way up is part of `network` and the way down too.
///
/// In lockstep there is no clock here. The client measures the whole way by its own, from a state's stamp to the first
/// use of the plan that answers it; two mean deviations on top keep most plans of a link that jitters from being late:
///   whole() = mean(round trip) + 2 mean deviations, held within [0, kMaxDelay].
/// Thread-safe: no (control step).   Real-time safe: yes.
class DelayEstimate {
 public:
  static constexpr std::chrono::nanoseconds kMaxDelay = std::chrono::milliseconds(400);

  void round_trip(std::chrono::nanoseconds measured) noexcept { take(measured, 0.0, &state_.round_trip); }
  void residence(std::chrono::nanoseconds measured) noexcept { take(measured, kFirstDeviation, &state_.residence); }
  void solve(std::chrono::nanoseconds measured) noexcept { take(measured, kFirstDeviation, &state_.solve); }

  std::chrono::nanoseconds network() const noexcept;
  std::chrono::nanoseconds ahead() const noexcept;
  std::chrono::nanoseconds whole() const noexcept;

  struct Mean {
    double value = 0.0;
    double deviation = 0.0;
    int count = 0;
  };
  /// All there is: to be written down, and set to what was.
  struct State {
    Mean round_trip, residence, solve;
  };
  const State& state() const noexcept { return state_; }
  void restore(const State& state) noexcept { state_ = state; }

 private:
  static constexpr double kFirstDeviation = 0.25;  ///< of the first value, as part of it
  /// What is longer counts as this long, so that one broken measurement doesn't move the means for half a second.
  static constexpr std::chrono::nanoseconds kLongest = 2 * kMaxDelay;
  /// The round trip's first deviation is nothing: over a simulated link without jitter, whole() is exact at once.
  static void take(std::chrono::nanoseconds measured, double first_deviation, Mean* mean) noexcept;

  State state_;
};

}  // namespace gatefield::pilot
