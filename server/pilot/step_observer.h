#pragma once

#include <cstdint>

#include "common/base/clock.h"
#include "server/gates/gate_belief.h"
#include "server/planner/planner.h"

namespace gatefield::pilot {

/// One control step, as whoever keeps records sees it. Non-owning, valid during the call.
struct StepRecord {
  Stamp stamp{0};                   ///< of the plan's start, the vehicle's clock
  std::uint32_t waypoint = 0;       ///< that is aimed at, index into the course
  const gates::GateBelief& target;  ///< what is believed of it, or the place behind the last gate; the planner may have
                                    ///< been told to aim at the nominal centre all the same
  const planner::PlanInput& input;
  const planner::Plan& plan;
};

/// Looks at the steps of a vehicle as they are made: for records and pictures, never in a race.
/// Called by the control side; an observer that allocates or writes takes the control step's real time with it.
class StepObserver {
 public:
  virtual ~StepObserver() = default;
  /// Who looks at the rollouts of this step; null: nobody. @param step  counter from 0
  virtual planner::RolloutObserver* rollouts(std::uint64_t step) noexcept = 0;
  /// A plan was made; it may still be withheld.
  virtual void made(const StepRecord& record) noexcept = 0;
};

}  // namespace gatefield::pilot
