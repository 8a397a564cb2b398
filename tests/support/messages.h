#pragma once

#include <cstring>
#include <string>

#include "common/protocol/messages.h"
#include "common/protocol/pilot_record.h"
#include "common/protocol/server_status.h"

/// Messages that pass validation, every field with a value of its own.
namespace gatefield::test {

inline protocol::SessionRequest good_request(const std::string& vehicle = "drone", std::uint64_t number = 7) {
  protocol::SessionRequest request;
  request.vehicle = vehicle;
  request.request = number;
  request.timing = protocol::Timing::kLockstep;
  request.profile = "race";
  request.seed = 42;
  request.speed_limit_m_s = 7.5;
  request.priority = 7;
  request.quadrotor.body_rate_max_rad_s = {9, 9, 6};
  request.camera = default_camera();
  request.camera.metres_per_count = 0.0005;
  request.camera.distortion_model = CameraModel::Distortion::kBrownConrady;
  request.camera.distortion = {1e-5, -2e-5, 3e-6, -4e-6, 5e-6};
  request.course.waypoints = {{{3, 0, 1.5}, {0, 1, 0}}, {{0, 3, 1.25}, {-1, 0, 0}}, {{-3, 0, 1.75}, {0, 0, 0}}};
  request.course.waypoints[1].gate = {GateShape::Opening::kRound, 0.6, 0.8, 0.125};
  request.course.waypoints[2].gate_id = 5;
  request.course.floor_z_m = -0.25;
  request.course.laps = 3;
  return request;
}

inline protocol::SessionReply good_reply(const std::string& vehicle = "drone", std::uint64_t number = 7) {
  protocol::SessionReply reply;
  reply.vehicle = vehicle;
  reply.request = number;
  reply.accepted = true;
  reply.server = "planner-1";
  reply.session = 0x1122334455667788u;
  reply.control_period_s = 0.02;
  reply.plan_step_s = 0.03;
  reply.plan_steps = 20;
  reply.model_hash = 0xfedcba9876543210u;
  reply.retry_after_s = 1.5;
  reply.heir = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  return reply;
}

inline protocol::VehicleState good_state(const std::string& vehicle = "drone", std::uint64_t sequence = 1) {
  protocol::VehicleState state;
  state.vehicle = vehicle;
  state.session = 0x1122334455667788u;
  state.sequence = sequence;
  state.stamp = Stamp(1'234'567'890'123);
  state.state.p_WB = {1.5, -2.25, 3.125};
  state.state.v_WB = {4.5, 5.25, -6.125};
  state.state.q_WB = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);  // w x y z
  state.state.w_WB_B = {0.25, -0.5, 1.75};
  state.state.thrust_n = {2.0, 2.25, 2.5, 2.75};
  state.state.thrust_command_n = {2.125, 2.375, 2.625, 2.875};
  state.thrust_known = false;
  state.round_trip = Stamp(4'200'000);
  state.depth_sequence = 5;
  state.heard_waypoint = 2;
  state.heard_lap = 1;
  state.asked = {protocol::AskedBy::kOther, {8.25, 0.5, -0.75, 1.25}};
  return state;
}

inline protocol::DepthFrame good_frame(const std::string& vehicle = "drone", std::uint64_t sequence = 1,
                                       std::uint32_t width_px = 160, std::uint32_t height_px = 90) {
  protocol::DepthFrame frame;
  frame.vehicle = vehicle;
  frame.session = 0x1122334455667788u;
  frame.sequence = sequence;
  frame.stamp = Stamp(1'234'500'000'000);
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.encoding = protocol::DepthEncoding::kCounts16;
  frame.pixels.resize(std::size_t{2} * width_px * height_px);
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) frame.pixels[i] = static_cast<std::uint8_t>(i * 7 + sequence);
  return frame;
}

inline protocol::PlannerHealth good_health() {
  protocol::PlannerHealth health;
  health.solve_time_s = 0.0045;
  health.effective_samples = 123.5;
  health.lowest_field_m = -0.125;
  health.latent_age_s = 0.0625;
  health.state_age_s = 0.0078125;
  health.target_waypoint = 2;
  health.lap = 1;
  health.course_done = false;
  health.degraded = true;
  health.problems = protocol::bit(protocol::Problem::kStatesLookNed) | protocol::bit(protocol::Problem::kDepthMissing);
  return health;
}

inline protocol::ThrustRateCommand good_command(const std::string& vehicle = "drone", std::uint64_t sequence = 1,
                                                int steps = 20) {
  protocol::ThrustRateCommand command;
  command.vehicle = vehicle;
  command.session = 0x1122334455667788u;
  command.sequence = sequence;
  command.answers_sequence = 9;
  command.answers_stamp = Stamp(1'234'567'890'123);
  command.plan_start = Stamp(1'234'570'000'000);
  command.plan_step = Stamp(30'000'000);
  command.validity = Stamp(600'000'000);
  command.steps = steps;
  for (int i = 0; i < protocol::kMaxPlanSteps; ++i) {  // quarters: exact in float32
    const auto k = static_cast<std::size_t>(i);
    const double x = 0.25 * i;
    const bool used = i < steps;
    command.thrust_rate_n_s[k] = used ? Eigen::Vector4d(x, -x, x + 1, -x - 1) : Eigen::Vector4d::Zero();
    command.rotor_thrust_n[k] = used ? Eigen::Vector4d(2 + x, 2.5 + x, 3 + x, 3.5 + x) : Eigen::Vector4d::Zero();
    command.collective_thrust_n[k] = used ? 11 + 4 * x : 0.0;
    command.body_rates_rad_s[k] = used ? Eigen::Vector3d(x, -x, 0.5) : Eigen::Vector3d::Zero();
  }
  command.health = good_health();
  std::memcpy(command.isa.data(), "avx2", 5);
  return command;
}

inline protocol::Telemetry good_telemetry(const std::string& vehicle = "drone") {
  protocol::Telemetry telemetry;
  telemetry.vehicle = vehicle;
  telemetry.session = 0x1122334455667788u;
  telemetry.server_stamp = Stamp(99'000'000'001);
  telemetry.health = good_health();
  telemetry.states_received = 1001;
  telemetry.states_rejected = 2;
  telemetry.frames_received = 303;
  telemetry.frames_rejected = 4;
  telemetry.frames_invalid = 5;
  telemetry.commands_sent = 996;
  telemetry.deadlines_missed = 6;
  telemetry.encode_time_s = 0.00375;
  telemetry.identified = {1.0625, {0.03125, 0.046875, 0.0625}, {0.0, 2.5, 1.25}};
  telemetry.last_code = ErrorCode::kInvalid;
  telemetry.last_field = "q_WB";
  telemetry.last_value = "of norm 2";
  telemetry.last_expected = "norm 1";
  telemetry.last_reason = "q_WB has norm 2, expected 1";
  telemetry.isa = "avx2";
  return telemetry;
}

/// Of a pilot that is no pilot.
inline protocol::PilotRecord good_record() {
  protocol::PilotRecord record;
  record.vehicle = "drone";
  record.session = 0x8f00000000000001;
  record.request = 17;
  record.kind = protocol::PilotRecord::Kind::kHandOver;
  record.take_overs = 3;
  record.written = Stamp{123'456'789'012};
  record.pilot = {0, 1, 2, 255};
  return record;
}

inline protocol::ServerStatus good_status(const std::string& name = "planner-1") {
  protocol::ServerStatus status;
  status.name = name;
  status.room_cores = 1.25;
  status.sessions = 3;
  status.accepts = true;
  status.isa = "avx2";
  status.model_hash = 0xfedcba9876543210u;
  return status;
}

}  // namespace gatefield::test
