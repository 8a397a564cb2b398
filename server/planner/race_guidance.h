#pragma once

#include "common/geometry/gate.h"
#include "common/vehicle/quadrotor.h"
#include "server/planner/planner.h"
#include "server/planner/rollout_batch.h"

namespace gatefield::planner {

/// More care near a gate that is not seen, or was seen long ago; all of it within Profile::near_m of the target:
///   not seen                     limit * unseen_speed_factor
///   seen, field of age t         limit * (1 - a (1 - stale_speed_factor)),  clearance + a stale_extra_clearance_m
///                                a = (t - field_fresh_s) / (field_stale_s - field_fresh_s), between 0 and 1
/// Holding, at any distance d     min(limit, max(0.5 m/s, 1.5 sqrt(d)))
struct Tightening {
  double speed_limit_m_s = 0.0;
  double extra_clearance_m = 0.0;  ///< on the crossing margin
};
/// Thread-safe: yes.   Real-time safe: yes.
Tightening tighten(const Profile& profile, const PlanInput& input) noexcept;

/// What a step's costs are measured by, made from what is believed of the gates: where the target, the gate after it
/// and the one passed last are and how to get there, and how much care is due.
/// The way back around a missed gate leads by the side on which the vehicle is. The side is kept while the vehicle is
/// within 0.4 m of the middle, or it would dither there: that is the state of this object.
/// Thread-safe: no.   Real-time safe: yes.
class RaceGuidance {
 public:
  /// @param cone_angle_rad  of the field's hourglass
  RaceGuidance(const Profile& profile, const QuadrotorModel& model, const GateShape& gate, double cone_angle_rad);

  /// Asks the target's field once, for the clearance at the start.
  PlanContext context(const PlanInput& input) noexcept;

  /// The side of the way back, 1 or -1: all that one step leaves to the next.
  double detour_side() const noexcept { return detour_side_; }
  void take_side(double side) noexcept { detour_side_ = side; }

 private:
  Guidance guide(const GateBelief& gate, bool hold, double side) const noexcept;

  Profile profile_;
  GateShape gate_;
  double collision_radius_m_;
  float cone_slope_;
  double detour_side_ = 1.0;
};

}  // namespace gatefield::planner
