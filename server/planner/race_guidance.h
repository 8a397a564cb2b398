#pragma once

#include "common/course/course.h"
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
///
/// One gate may be target, next and passed at once (a lap of one gate, a gate flown there and back). It is known by its
/// place: two gates don't stand in each other.
///   The next gate is the target, the same way    the way to it leads around the frame from the plane on, and counts
///                                                from there: to be through costs nothing
///   The target was just passed, the same way     the same while the vehicle is behind it, where the frame also bars
///                                                the way back through; in front of it, it is a target like any other
///   The target was just passed the other way     a target like any other: the way back leads through it
/// Thread-safe: no.   Real-time safe: yes.
class RaceGuidance {
 public:
  /// @param course          heights count from its reference (height_reference_m())
  /// @param cone_angle_rad  of the field's hourglass
  RaceGuidance(const Profile& profile, const QuadrotorModel& model, const Course& course, double cone_angle_rad);

  /// Asks the target's field once, for the clearance at the start.
  PlanContext context(const PlanInput& input) noexcept;

  /// The side of the way back, 1 or -1: all that one step leaves to the next.
  double detour_side() const noexcept { return detour_side_; }
  void take_side(double side) noexcept { detour_side_ = side; }

 private:
  Guidance guide(const GateBelief& gate, bool hold, double side) const noexcept;
  FrameSize frame_of(const GateBelief& gate) const noexcept;

  Profile profile_;
  double height_reference_m_;
  double collision_radius_m_;
  Eigen::Vector3f body_rate_limit_rad_s_;
  float cone_slope_;
  double detour_side_ = 1.0;
};

}  // namespace gatefield::planner
