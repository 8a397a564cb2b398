#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "common/course/course.h"
#include "common/vehicle/actuation.h"
#include "common/vehicle/quadrotor.h"
#include "server/gates/gate_belief.h"
#include "server/kernels/backend.h"
#include "server/kernels/crew.h"
#include "server/planner/profile.h"

namespace gatefield::planner {

using gates::Field;
using gates::GateBelief;

inline constexpr int kMaxSteps = 64;

struct RolloutBatch;

/// Looks at the rollouts of a step as they are weighed, block by block: for records and pictures, never in a race,
/// since all rollouts are decoded then, by one thread.
class RolloutObserver {
 public:
  virtual ~RolloutObserver() = default;
  /// @param first  number of the batch's first rollout among all of the step
  virtual void see(const RolloutBatch& batch, int first) noexcept = 0;
};

/// What a step plans from.
struct PlanInput {
  QuadrotorState start;  ///< predicted to the moment when the plan's first input begins to hold
  /// Vehicles of Actuation::Kind::kBodyRates: what they are asked for when the plan's first input begins to hold.
  RateCommand asked = RateCommand::Zero();
  double thrust_factor = 1.0;  ///< and what they really give, over what they are thought to
  double elapsed_s = 0.0;      ///< between the previous plan's start and this one's: shifts the warm start
  std::uint64_t step = 0;      ///< counter of the noise; the same (seed, step, input) gives the same plan
  GateBelief target;           ///< the gate to pass now
  GateBelief next;             ///< the one after it
  bool has_next = false;
  Eigen::Vector3d disturbance_W_m_s2 = Eigen::Vector3d::Zero();  ///< acceleration beyond the model's, over the horizon
  GateBelief passed_gate;  ///< the one passed last, without its field: its frame may still be in the way
  bool has_passed_gate = false;
  bool hold = false;             ///< course done: stay near target.center_W instead of passing it
  double field_age_s = 0.0;      ///< age of target.field; ignored when there is none
  double speed_limit_m_s = 0.0;  ///< of the session; 0 = the profile's
};

/// What comes out. Arrays hold `steps` entries.
struct Plan {
  int steps = 0;
  std::array<ThrustRates, kMaxSteps> thrust_rate_n_s;  ///< applied inputs (within limits); by body rates zero
  std::array<RateCommand, kMaxSteps> rate_command;     ///< by body rates: what to ask for during each step; else zero
  std::array<QuadrotorState, kMaxSteps> state;         ///< predicted at the end of each step
  double effective_samples = 0.0;
  double temperature = 0.0;
  double lowest_field_m = 0.0;  ///< of the target's field along the plan; 0 when there is none
  int decoded_rollouts = 0;     ///< for how many the field was asked
  bool ok = false;              ///< false: no rollout had a finite cost; the previous plan, shifted, is returned
};

/// What a plan takes over from the one before it: to be written down, and set to what was.
struct WarmStart {
  std::vector<PlainVector4> mean;           ///< the mean inputs, one for each of the profile's steps
  RateCommand asked = RateCommand::Zero();  ///< by body rates: what the plan asks for where it starts; else zero
  double detour_side = 1.0;                 ///< on which side a missed gate is flown around, 1 or -1
};

/// Whether every gate of the course can be flown through between the heights that the profile permits, [lowest,
/// highest] = height_reference_m(course) + [altitude_min_m, altitude_max_m]: with the centre of mass at some height of
///   z +- max(0, inner_half - collision_radius)
/// for an opening at z. A profile without altitude_weight permits every height. The field at fault is
/// "course.waypoints[i].p_W".
/// Thread-safe: yes.   Real-time safe: no.
Status check_heights(const Profile& profile, const QuadrotorModel& model, const Course& course);

/// What is planned for, beside the vehicle's model, and how a step is computed.
struct PlannerOptions {
  Actuation actuation = {};  ///< how the vehicle is driven
  /// Whose free threads help with the blocks of a step; null: none. Outlives the planner. The plan is the same.
  kernels::Crew* crew = nullptr;
  /// Leaves the field out for rollouts that can no longer get weight (short_list.h). The plan is the same within single
  /// precision's rounding.
  bool leave_out = true;
  /// Who computes samples, rollouts and averages; null: the best of the machine. The field brings its own. Plans of two
  /// back ends differ as far as their tolerances say.
  const kernels::Backend* backend = nullptr;
};

/// Plans what a vehicle is asked for. The one that planning servers have is MPPI (mppi.h); create() makes it.
/// Thread-safe: no, one instance per session.   Real-time safe: plan() yes (no allocation, lock or system call, but for
/// what Crew says), in threads that called prepare_thread(); others allocate their workspace in their first step.
/// The same seed and inputs give the same plan, bit for bit, whatever the number of threads and whatever planners on
/// other back ends do (on one back end).
class Planner {
 public:
  /// @param course          to be flown: what its heights count from
  /// @param cone_angle_rad  of the hourglass that the field was trained with (model manifest)
  /// Errors: what validate() says of profile, model, actuation and course, and what check_heights() does.
  static Result<std::unique_ptr<Planner>> create(const Profile& profile, const QuadrotorModel& model,
                                                 const Course& course, double cone_angle_rad, std::uint64_t seed,
                                                 const PlannerOptions& options = {});
  /// Allocates what a thread needs to plan or to help, once.
  static void prepare_thread();
  virtual ~Planner() = default;
  virtual void plan(const PlanInput& input, Plan* plan) noexcept = 0;
  /// Forgets the warm start.
  virtual void reset() noexcept = 0;
  /// With the same warm start, profile and seed the next plan is the same, bit for bit. Allocates.
  virtual WarmStart warm_start() const = 0;
  /// @return false, and nothing changes, when it is not of the profile's length or not finite
  virtual bool restore(const WarmStart& start) = 0;
  virtual const Profile& profile() const noexcept = 0;
  /// Shows the rollouts of every later step to `observer`; null: to nobody, as at first. A planner that rolls nothing
  /// out has nothing to show.
  virtual void watch(RolloutObserver* /*observer*/) noexcept {}
};

}  // namespace gatefield::planner
