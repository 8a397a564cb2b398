#pragma once

#include <string>

#include "common/base/result.h"

namespace gatefield::planner {

enum class ProgressMetric {
  kSquaredDistance,  ///< as printed in the paper
  kDistance,         ///< ours: telescopes to the distance left, so that speed is worth the same everywhere
};

/// Everything that shapes the planner. One file under deploy/config/profiles is one of these, with these names. Weights
/// are per rollout step unless said otherwise, costs are dimensionless. Ranges stand in the tables below.
struct Profile {
  std::string name = "race";

  // Sampling (paper, Table "parameters used in simulation")
  int samples = 2048;            ///< M, a multiple of 16
  int steps = 20;                ///< K
  double step_s = 0.03;          ///< dt
  double control_rate_hz = 100;  ///< plans a second

  // Vehicles that are asked for rotor thrusts (Actuation::Kind::kRotorThrusts): how fast those change. Thrusts count in
  // hover thrusts (per rotor), torques by what they do to the vehicle, so that a profile fits vehicles of any mass and
  // inertia. The defaults are 3 N/s of collective, roll and pitch, 9 N/s of yaw, per rotor, of the vehicle `racer`.
  double rotors_change_limit_s = 15.0;  ///< of each rotor's thrust, hover thrusts per second; its own limit holds, too
  double rotors_thrust_sigma_s = 1.473785048;     ///< spread of the collective's change, hover thrusts per second
  double rotors_tilt_sigma_rad_s3 = 298.4516129;  ///< of the change of the angular acceleration about x and y
  double rotors_yaw_sigma_rad_s3 = 115.2;
  double rotors_correlation = 0.0;  ///< between neighbouring steps; 0: white. The spread of each step stays the same

  // Vehicles that are asked for collective thrust and body rates (Actuation::Kind::kBodyRates). Thrusts are parts of
  // the hover's or of the total.
  bool rates_by_changes = false;         ///< samples changes per second instead of what is asked for
  double rates_correlation = 0.85;       ///< of what is asked for between neighbouring steps; changes are white
  double rates_thrust_sigma = 0.3;       ///< spread of what is asked for, hover thrusts
  double rates_tilt_sigma_rad_s = 0.85;  ///< about x and y
  double rates_yaw_sigma_rad_s = 0.5;
  double rates_thrust_change_sigma_s = 4.5;  ///< spread of the changes, hover thrusts per second
  double rates_tilt_change_sigma_rad_s2 = 12.0;
  double rates_yaw_change_sigma_rad_s2 = 10.0;
  double rates_thrust_low = 0.12;       ///< of the total thrust: below, the mixer has no torque left
  double rates_thrust_high = 0.8;       ///< and above
  double rates_tilt_limit_rad_s = 9.0;  ///< about x and y; a vehicle's own limit holds as well
  double rates_yaw_limit_rad_s = 6.0;

  // Model
  double disturbance_time_s = 0.4;  ///< over which the acceleration beyond the model is averaged; 0: not estimated
  /// Plans from where the vehicle will be when the plan can begin to hold; off: from where it was measured, and the
  /// first part of each plan comes too late to be flown.
  bool predict_delay = true;

  // Temperature: fixed when target_effective_fraction is 0, else found each step so that 1 / sum w^2 is this part of M
  double temperature = 1.0;
  double target_effective_fraction = 0.0;
  double temperature_min = 0.01;
  double temperature_max = 100.0;

  // Progress (paper, Eq. "gate_progress")
  double progress_weight = 10.0;
  ProgressMetric progress_metric = ProgressMetric::kDistance;
  /// The waypoint is the opening's centre as the field shows it; off: the nominal one, in every cost.
  bool waypoint_from_field = true;
  bool switch_in_rollout = true;  ///< beyond the opening, a rollout heads for the next gate
  bool funnel = true;             ///< outside the cone first to a point in front of the gate
  double funnel_half_angle_rad = 0.70;
  double funnel_distance_m = 1.5;  ///< of the usual gate (gates::gate_size()), as is look_ahead_m

  // Visibility (paper, Eq. "visibility_cost")
  double visibility_weight = 1.0;
  double look_ahead_m = 1.0;  ///< nearer than this to the opening (of the usual gate), look at the next gate

  // Gate-SDF (paper, Eq. "C_sdf")
  double field_weight = 0.5;
  double field_clearance_m = 1.0;  ///< d_safe, of the usual gate

  // Crossing the gate's plane: clearance left at the frame, from decoder values
  double crossing_weight = 100.0;
  double crossing_margin_m = 0.08;  ///< beyond the vehicle's own radius

  // Limits
  double speed_weight = 1.0;  ///< (v - limit)^2
  double speed_limit_m_s = 8.0;
  double body_rate_weight = 1.0;       ///< (|w| - limit)^2
  double body_rate_limit_rad_s = 9.0;  ///< a vehicle's own limit about an axis holds as well, where it is lower
  /// Per metre outside of altitude_min_m to altitude_max_m. Both count from height_reference_m() of the course: from
  /// the floor where the course tells it, else from 1.5 m below its lowest gate. With a weight, a course with a gate
  /// that can't be passed between them is refused (check_heights()).
  double altitude_weight = 20.0;
  double altitude_min_m = 0.4;
  double altitude_max_m = 120.0;  ///< what most rules allow above ground

  // Losing sight tightens: near the gate, from field_fresh_s to field_stale_s of the field's age (a gate remembered
  // from the last lap is old, but far away; it is seen again before it matters)
  double near_m = 4.0;
  double field_fresh_s = 0.6;
  double field_stale_s = 2.0;
  double stale_speed_factor = 0.5;       ///< of the speed limit
  double stale_extra_clearance_m = 0.1;  ///< on the crossing margin
  double unseen_speed_factor = 0.6;      ///< of the speed limit, near where a gate should be that has not been seen
};

/// What a file may say: a field's name in it, the member, and its range, both ends in. Reading a file and checking
/// ranges both walk these tables; a member that stands in none of them can't be set.
struct NumberField {
  const char* name;
  double Profile::*member;
  double min;
  double max;
};
struct IntegerField {
  const char* name;
  int Profile::*member;
  int min;
  int max;
};
struct SwitchField {
  const char* name;
  bool Profile::*member;
};
struct MetricName {
  const char* name;
  ProgressMetric value;
};

inline constexpr IntegerField kIntegerFields[] = {
    {"samples", &Profile::samples, 16, 16384},
    {"steps", &Profile::steps, 2, 64},
};

inline constexpr SwitchField kSwitchFields[] = {
    {"waypoint_from_field", &Profile::waypoint_from_field},
    {"switch_in_rollout", &Profile::switch_in_rollout},
    {"funnel", &Profile::funnel},
    {"predict_delay", &Profile::predict_delay},
    {"rates_by_changes", &Profile::rates_by_changes},
};

inline constexpr NumberField kNumberFields[] = {
    {"step_s", &Profile::step_s, 0.005, 0.2},
    {"control_rate_hz", &Profile::control_rate_hz, 5, 500},
    {"rotors_change_limit_s", &Profile::rotors_change_limit_s, 0.1, 1e4},
    {"rotors_thrust_sigma_s", &Profile::rotors_thrust_sigma_s, 0, 1000},
    {"rotors_tilt_sigma_rad_s3", &Profile::rotors_tilt_sigma_rad_s3, 0, 1e6},
    {"rotors_yaw_sigma_rad_s3", &Profile::rotors_yaw_sigma_rad_s3, 0, 1e6},
    {"rotors_correlation", &Profile::rotors_correlation, 0, 0.95},
    {"rates_correlation", &Profile::rates_correlation, 0, 0.99},
    {"rates_thrust_sigma", &Profile::rates_thrust_sigma, 0, 10},
    {"rates_tilt_sigma_rad_s", &Profile::rates_tilt_sigma_rad_s, 0, 100},
    {"rates_yaw_sigma_rad_s", &Profile::rates_yaw_sigma_rad_s, 0, 100},
    {"rates_thrust_change_sigma_s", &Profile::rates_thrust_change_sigma_s, 0, 1000},
    {"rates_tilt_change_sigma_rad_s2", &Profile::rates_tilt_change_sigma_rad_s2, 0, 10000},
    {"rates_yaw_change_sigma_rad_s2", &Profile::rates_yaw_change_sigma_rad_s2, 0, 10000},
    {"rates_thrust_low", &Profile::rates_thrust_low, 0, 0.5},
    {"rates_thrust_high", &Profile::rates_thrust_high, 0.5, 1},
    {"rates_tilt_limit_rad_s", &Profile::rates_tilt_limit_rad_s, 0.5, 100},
    {"rates_yaw_limit_rad_s", &Profile::rates_yaw_limit_rad_s, 0.5, 100},
    {"disturbance_time_s", &Profile::disturbance_time_s, 0, 10},
    {"temperature", &Profile::temperature, 1e-6, 1e6},
    {"target_effective_fraction", &Profile::target_effective_fraction, 0, 1},
    {"temperature_min", &Profile::temperature_min, 1e-6, 1e6},
    {"temperature_max", &Profile::temperature_max, 1e-6, 1e6},
    {"progress_weight", &Profile::progress_weight, 0, 1e6},
    {"funnel_half_angle_rad", &Profile::funnel_half_angle_rad, 0.1, 1.5},
    {"funnel_distance_m", &Profile::funnel_distance_m, 0, 10},
    {"visibility_weight", &Profile::visibility_weight, 0, 1e6},
    {"look_ahead_m", &Profile::look_ahead_m, 0, 10},
    {"field_weight", &Profile::field_weight, 0, 1e6},
    {"field_clearance_m", &Profile::field_clearance_m, 0, 10},
    {"crossing_weight", &Profile::crossing_weight, 0, 1e6},
    {"crossing_margin_m", &Profile::crossing_margin_m, 0, 2},
    {"speed_weight", &Profile::speed_weight, 0, 1e6},
    {"speed_limit_m_s", &Profile::speed_limit_m_s, 0.5, 50},
    {"body_rate_weight", &Profile::body_rate_weight, 0, 1e6},
    {"body_rate_limit_rad_s", &Profile::body_rate_limit_rad_s, 0.5, 100},
    {"altitude_weight", &Profile::altitude_weight, 0, 1e6},
    {"altitude_min_m", &Profile::altitude_min_m, -1000, 10000},
    {"altitude_max_m", &Profile::altitude_max_m, -1000, 10000},
    {"field_fresh_s", &Profile::field_fresh_s, 0, 60},
    {"field_stale_s", &Profile::field_stale_s, 0, 120},
    {"stale_speed_factor", &Profile::stale_speed_factor, 0.05, 1},
    {"stale_extra_clearance_m", &Profile::stale_extra_clearance_m, 0, 1},
    {"unseen_speed_factor", &Profile::unseen_speed_factor, 0.05, 1},
    {"near_m", &Profile::near_m, 0, 50},
};

/// Words of the field progress_metric. Beside these tables a file has `name`.
inline constexpr MetricName kProgressMetrics[] = {
    {"SQUARED_DISTANCE", ProgressMetric::kSquaredDistance},
    {"DISTANCE", ProgressMetric::kDistance},
};

/// Says which field is wrong, its value and the range. Field paths begin with "profile.".
Status validate(const Profile& profile);

}  // namespace gatefield::planner
