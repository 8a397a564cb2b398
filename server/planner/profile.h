#pragma once

#include <array>
#include <string>

#include "common/base/result.h"

namespace gatefield::planner {

enum class ProgressMetric {
  kSquaredDistance,  ///< as printed in the paper
  kDistance,         ///< ours: telescopes to the distance left, so that speed is worth the same everywhere
};

/// Everything that shapes the planner. One file under deploy/config/profiles is one of these; the schema with the same
/// names is server/planner/profile.proto. Weights are per rollout step unless said otherwise, costs are dimensionless.
struct Profile {
  std::string name = "race";

  // Sampling (paper, Table "parameters used in simulation")
  int samples = 2048;                                 ///< M, 16 to 16384, multiple of 16
  int steps = 20;                                     ///< K, 2 to 64
  double step_s = 0.03;                               ///< dt, 0.005 to 0.2
  double control_rate_hz = 100;                       ///< plans a second, 5 to 500
  double thrust_rate_limit_n_s = 30.0;                ///< per rotor; the vehicle's own limit holds as well
  std::array<double, 4> noise_sigma_n_s{3, 3, 3, 9};  ///< collective, roll, pitch, yaw in mixer space
  double noise_correlation = 0.0;  ///< between neighbouring steps; 0: white. The spread of each step stays the same

  // Model
  double disturbance_time_s = 0.4;  ///< over which the acceleration beyond the model is averaged; 0: not estimated

  bool predict_delay = true;  ///< plan from where the vehicle will be when the plan can begin to hold; off: from where
                              ///< it was measured, and the first part of each plan comes too late to be flown

  // Temperature: fixed when target_effective_fraction is 0, else found each step so that 1 / sum w^2 is this part of M
  double temperature = 1.0;
  double target_effective_fraction = 0.0;
  double temperature_min = 0.01;
  double temperature_max = 100.0;

  // Progress (paper, Eq. "gate_progress")
  double progress_weight = 10.0;
  ProgressMetric progress_metric = ProgressMetric::kDistance;
  bool waypoint_from_field =
      true;  ///< the waypoint is the opening's centre as the field shows it; off: the nominal one, in every cost
  bool switch_in_rollout = true;  ///< beyond the opening, a rollout heads for the next gate
  bool funnel = true;             ///< outside the cone first to a point in front of the gate
  double funnel_half_angle_rad = 0.70;
  double funnel_distance_m = 1.5;

  // Visibility (paper, Eq. "visibility_cost")
  double visibility_weight = 1.0;
  double look_ahead_m = 1.0;  ///< nearer than this to the opening, look at the next gate

  // Gate-SDF (paper, Eq. "C_sdf")
  double field_weight = 0.5;
  double field_clearance_m = 1.0;  ///< d_safe

  // Crossing the gate's plane: clearance left at the frame, from decoder values
  double crossing_weight = 100.0;
  double crossing_margin_m = 0.08;  ///< beyond the vehicle's own radius

  // Limits
  double speed_weight = 1.0;  ///< (v - limit)^2
  double speed_limit_m_s = 8.0;
  double body_rate_weight = 1.0;  ///< (|w| - limit)^2
  double body_rate_limit_rad_s = 9.0;
  double altitude_weight = 20.0;  ///< per metre outside
  double altitude_min_m = 0.4;
  double altitude_max_m = 30.0;

  // Losing sight tightens: near the gate, from field_fresh_s to field_stale_s of the field's age (a gate remembered
  // from the last lap is old, but far away; it is seen again before it matters)
  double near_m = 4.0;
  double field_fresh_s = 0.6;
  double field_stale_s = 2.0;
  double stale_speed_factor = 0.5;       ///< of the speed limit
  double stale_extra_clearance_m = 0.1;  ///< on the crossing margin
  double unseen_speed_factor = 0.6;      ///< of the speed limit, near where a gate should be that has not been seen
};

/// Says which field is wrong, its value and the range.
Status validate(const Profile& profile);

}  // namespace gatefield::planner
