#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "common/geometry/gate.h"
#include "common/vehicle/quadrotor.h"
#include "server/planner/field.h"
#include "server/planner/profile.h"

namespace gatefield::planner {

inline constexpr int kMaxSteps = 64;

/// What a step plans from.
struct PlanInput {
  QuadrotorState start;    ///< predicted to the moment when the plan's first input begins to hold
  double elapsed_s = 0.0;  ///< between the previous plan's start and this one's: shifts the warm start
  std::uint64_t step = 0;  ///< counter of the noise; the same (seed, step, input) gives the same plan
  GateBelief target;       ///< the gate to pass now
  GateBelief next;         ///< the one after it
  bool has_next = false;
  bool hold = false;             ///< course done: stay near target.center_W instead of passing it
  double field_age_s = 0.0;      ///< age of target.field; ignored when there is none
  double speed_limit_m_s = 0.0;  ///< of the session; 0 = the profile's
};

/// What comes out. Arrays hold `steps` entries.
struct Plan {
  int steps = 0;
  std::array<ThrustRates, kMaxSteps> thrust_rate_n_s;  ///< applied inputs (within limits)
  std::array<QuadrotorState, kMaxSteps> state;         ///< predicted at the end of each step
  double effective_samples = 0.0;
  double temperature = 0.0;
  double lowest_field_m = 0.0;  ///< of the target's field along the plan; 0 when there is none
  bool ok = false;              ///< false: no rollout had a finite cost; the previous plan, shifted, is returned
};

/// MPPI over thrust rates (paper, "Vision Guided Racing Controller via MPPI").
/// Thread-safe: no, one instance per session.   Real-time safe: plan() yes (no allocation, lock or system call).
class Planner {
 public:
  /// @param gate  nominal shape of the course's gates
  /// @param cone_angle_rad  of the hourglass that the field was trained with (model manifest)
  static Result<std::unique_ptr<Planner>> create(const Profile& profile, const QuadrotorModel& model,
                                                 const GateShape& gate, double cone_angle_rad, std::uint64_t seed);
  virtual ~Planner() = default;
  virtual void plan(const PlanInput& input, Plan* plan) noexcept = 0;
  /// Forgets the warm start.
  virtual void reset() noexcept = 0;
  virtual const Profile& profile() const noexcept = 0;
};

}  // namespace gatefield::planner
