#include "common/protocol/problems.h"

#include <array>

namespace gatefield::protocol {
namespace {

struct Text {
  std::string_view name;
  std::string_view sentence;
};

/// In the order of the enumeration.
constexpr std::array<Text, kProblems> kTexts{{
    {"gate_not_seen",
     "no gate was seen yet where one should be in view: check the waypoint, the gate's size and the camera's mounting"},
    {"few_effective_samples",
     "the plan has followed one or two rollouts for a second: check mass and thrust of the vehicle against the "
     "profile's sampling noise"},
    {"plan_not_finite", "plans are withheld: inputs or predicted states were not finite; check inertia and drag"},
    {"plan_thrust_rate", "plans are withheld: a thrust rate was beyond the vehicle's limit"},
    {"plan_thrust", "plans are withheld: a rotor thrust was beyond the vehicle's limits"},
    {"plan_body_rate", "plans are withheld: a body rate was beyond 200 rad/s"},
    {"velocity_against_motion",
     "the velocity sent is not the change of the position sent: check frame and unit of v_WB"},
    {"thrust_against_motion",
     "the vehicle does not accelerate along its thrust axis: check q_WB, the rotors' thrusts and the mass"},
    {"rates_against_attitude",
     "the body rates sent are not the change of the attitude sent: check frame and unit of w_WB_B, and q_WB"},
    {"states_look_ned", "likely cause: states are sent in NED and FRD, expected ENU and FLU (x forward, y left, z up)"},
    {"quaternion_looks_w_first", "likely cause: the quaternion is sent as w, x, y, z, expected x, y, z, w"},
    {"velocity_looks_body_frame", "likely cause: the velocity is sent in the body frame, expected the world frame"},
    {"rates_look_world_frame", "likely cause: body rates are sent in the world frame, expected the body frame"},
    {"rotors_look_swapped",
     "likely cause: rotors turn or push elsewhere than the vehicle file says: check their order, places and spins"},
    {"mounting_looks_wrong",
     "gates appear where the camera's mounting says they can't be: check camera.X_BC, also for an image that is upside "
     "down"},
    {"depth_unit_looks_wrong",
     "gates appear larger or smaller than they are by a constant factor: check metres_per_count, or whether float "
     "depth is in metres"},
    {"stamps_jump",
     "stamps or sequence numbers jumped: samples are dropped until a few agree, or the clock began anew"},
    {"depth_missing", "no usable depth frame came for half a second"},
    {"states_missing", "no usable state came for two control periods"},
    {"states_rejected", "states are refused; telemetry's last_reason says why"},
    {"frames_rejected", "depth frames are refused; telemetry's last_reason says why"},
    {"delay_long", "the delay is longer than the 0.4 s that the planner makes up for"},
    {"deadlines_missed", "control steps are late: fewer vehicles, fewer samples or a faster machine would help"},
    {"thrust_unlike_told",
     "the vehicle gives more than 15 % more or less thrust than it is asked for: check its mass, its thrust curve and "
     "the "
     "battery"},
    {"rate_loop_unlike_told",
     "body rates follow their command much faster or slower than told: check actuation.rate_time_constant_s and the "
     "flight controller's gains"},
    {"rate_limit_unlike_told",
     "body rates stay at a limit below what they are asked for: check quadrotor.body_rate_max_rad_s and the flight "
     "controller's limits of rates"},
}};

}  // namespace

std::string_view name(Problem problem) noexcept { return kTexts[static_cast<std::size_t>(problem)].name; }

std::string_view sentence(Problem problem) noexcept { return kTexts[static_cast<std::size_t>(problem)].sentence; }

std::vector<Problem> list(Problems problems) {
  std::vector<Problem> found;
  for (int i = 0; i < kProblems; ++i)
    if (problems >> i & 1) found.push_back(static_cast<Problem>(i));
  return found;
}

}  // namespace gatefield::protocol
