#pragma once

#include "server/planner/profile.h"

namespace gatefield::planner {

/// The one list of a profile's plain fields: reading a file and checking ranges both walk it. Names are the schema's.
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

inline constexpr IntegerField kIntegerFields[] = {
    {"samples", &Profile::samples, 16, 16384},
    {"steps", &Profile::steps, 2, 64},
};

inline constexpr SwitchField kSwitchFields[] = {
    {"waypoint_from_field", &Profile::waypoint_from_field},
    {"switch_in_rollout", &Profile::switch_in_rollout},
    {"funnel", &Profile::funnel},
    {"predict_delay", &Profile::predict_delay},
};

inline constexpr NumberField kNumberFields[] = {
    {"step_s", &Profile::step_s, 0.005, 0.2},
    {"control_rate_hz", &Profile::control_rate_hz, 5, 500},
    {"thrust_rate_limit_n_s", &Profile::thrust_rate_limit_n_s, 0.1, 1e5},
    {"noise_correlation", &Profile::noise_correlation, 0, 0.95},
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

}  // namespace gatefield::planner
