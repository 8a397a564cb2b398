#include "common/dds/convert.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

namespace gatefield::dds {

// The IDL says these once more, for those who see only the IDL.
static_assert(wire::PROTOCOL_VERSION == protocol::kVersion);
static_assert(wire::NAME_LENGTH == protocol::kMaxNameLength);
static_assert(wire::REASON_LENGTH == protocol::kMaxReasonLength);
static_assert(wire::FIELD_LENGTH == protocol::kMaxFieldLength);
static_assert(wire::WAYPOINTS == kMaxWaypoints);
static_assert(wire::PLAN_STEPS == protocol::kMaxPlanSteps);
static_assert(wire::ISA_LENGTH + 1 == std::tuple_size_v<decltype(protocol::ThrustRateCommand::isa)>);

namespace {

// Hostile counts stay hostile after the conversion (so that validate() names them) without overflowing an int.
int to_int(std::uint32_t value) {
  return static_cast<int>(std::min<std::uint32_t>(value, std::numeric_limits<int>::max()));
}
std::uint32_t to_unsigned(int value) { return value < 0 ? 0u : static_cast<std::uint32_t>(value); }

template <typename Scalar, std::size_t N, int kOptions>
void put(const Eigen::Matrix<double, static_cast<int>(N), 1, kOptions>& v, std::array<Scalar, N>* out) {
  for (std::size_t i = 0; i < N; ++i) (*out)[i] = static_cast<Scalar>(v[static_cast<Eigen::Index>(i)]);
}
template <typename Scalar, std::size_t N, int kOptions>
void get(const std::array<Scalar, N>& in, Eigen::Matrix<double, static_cast<int>(N), 1, kOptions>* v) {
  for (std::size_t i = 0; i < N; ++i) (*v)[static_cast<Eigen::Index>(i)] = in[i];
}

void to_wire(const QuadrotorModel& in, wire::Quadrotor* out) {
  out->mass_kg(in.mass_kg);
  put(in.inertia_kg_m2, &out->inertia_kg_m2());
  for (std::size_t i = 0; i < kRotors; ++i) {
    put(in.rotor_position_B_m[i], &out->rotor_position_B_m()[i]);
    out->rotor_spin()[i] = static_cast<std::int16_t>(in.rotor_spin[i]);
  }
  out->torque_per_thrust_m(in.torque_per_thrust_m);
  out->thrust_min_n(in.thrust_min_n);
  out->thrust_max_n(in.thrust_max_n);
  out->thrust_rate_max_n_s(in.thrust_rate_max_n_s);
  out->rotor_time_constant_s(in.rotor_time_constant_s);
  put(in.drag_kg_s, &out->drag_kg_s());
  out->collision_radius_m(in.collision_radius_m);
  put(in.body_rate_max_rad_s, &out->body_rate_max_rad_s());
}

void from_wire(const wire::Quadrotor& in, QuadrotorModel* out) {
  out->mass_kg = in.mass_kg();
  get(in.inertia_kg_m2(), &out->inertia_kg_m2);
  for (std::size_t i = 0; i < kRotors; ++i) {
    get(in.rotor_position_B_m()[i], &out->rotor_position_B_m[i]);
    out->rotor_spin[i] = in.rotor_spin()[i];
  }
  out->torque_per_thrust_m = in.torque_per_thrust_m();
  out->thrust_min_n = in.thrust_min_n();
  out->thrust_max_n = in.thrust_max_n();
  out->thrust_rate_max_n_s = in.thrust_rate_max_n_s();
  out->rotor_time_constant_s = in.rotor_time_constant_s();
  get(in.drag_kg_s(), &out->drag_kg_s);
  out->collision_radius_m = in.collision_radius_m();
  get(in.body_rate_max_rad_s(), &out->body_rate_max_rad_s);
}

void to_wire(const Actuation& in, wire::Actuation* out) {
  out->kind(static_cast<std::uint8_t>(in.kind));
  out->thrust_time_constant_s(in.thrust_time_constant_s);
  const Eigen::Vector3d rates_s = in.rate_time_constant_s;
  put(rates_s, &out->rate_time_constant_s());
}

void from_wire(const wire::Actuation& in, Actuation* out) {
  out->kind = static_cast<Actuation::Kind>(in.kind());
  out->thrust_time_constant_s = in.thrust_time_constant_s();
  Eigen::Vector3d rates_s;
  get(in.rate_time_constant_s(), &rates_s);
  out->rate_time_constant_s = rates_s;
}

void to_wire(const CameraModel& in, wire::Camera* out) {
  out->width_px(to_unsigned(in.width_px));
  out->height_px(to_unsigned(in.height_px));
  out->fx_px(in.fx_px);
  out->fy_px(in.fy_px);
  out->cx_px(in.cx_px);
  out->cy_px(in.cy_px);
  out->min_depth_m(in.min_depth_m);
  out->max_depth_m(in.max_depth_m);
  out->rate_hz(in.rate_hz);
  const Eigen::Vector3d p_BC = in.X_BC.translation();
  put(p_BC, &out->p_BC());
  Eigen::Vector4d q_BC = Eigen::Quaterniond(in.X_BC.linear()).coeffs();
  if (q_BC.w() < 0) q_BC = -q_BC;  // one of the two that mean the same, so that equal cameras are equal bytes
  put(q_BC, &out->q_BC());
  out->metres_per_count(in.metres_per_count);
  out->distortion_model(static_cast<std::uint8_t>(in.distortion_model));
  out->distortion() = in.distortion;
}

void from_wire(const wire::Camera& in, CameraModel* out) {
  out->width_px = to_int(in.width_px());
  out->height_px = to_int(in.height_px());
  out->fx_px = in.fx_px();
  out->fy_px = in.fy_px();
  out->cx_px = in.cx_px();
  out->cy_px = in.cy_px();
  out->min_depth_m = in.min_depth_m();
  out->max_depth_m = in.max_depth_m();
  out->rate_hz = in.rate_hz();
  Eigen::Vector3d p_BC;
  get(in.p_BC(), &p_BC);
  Eigen::Vector4d q_BC;
  get(in.q_BC(), &q_BC);
  out->X_BC = Eigen::Isometry3d::Identity();
  out->X_BC.translation() = p_BC;
  // A rotation can't hold what is no rotation: zero, so that validate() refuses the mounting.
  if (q_BC.allFinite() && std::abs(q_BC.norm() - 1.0) <= 1e-3)
    out->X_BC.linear() = Eigen::Quaterniond(q_BC).normalized().toRotationMatrix();
  else
    out->X_BC.linear().setZero();
  out->metres_per_count = in.metres_per_count();
  out->distortion_model = static_cast<CameraModel::Distortion>(in.distortion_model());
  out->distortion = in.distortion();
}

void to_wire(const Waypoint& in, wire::Waypoint* out) {
  put(in.p_W, &out->p_W());
  put(in.direction_W, &out->direction_W());
  out->gate_opening(static_cast<std::uint8_t>(in.gate.opening));
  out->gate_inner_half_m(in.gate.inner_half_m);
  out->gate_outer_half_m(in.gate.outer_half_m);
  out->gate_thickness_m(in.gate.thickness_m);
  out->gate_id(in.gate_id);
}

void from_wire(const wire::Waypoint& in, Waypoint* out) {
  get(in.p_W(), &out->p_W);
  get(in.direction_W(), &out->direction_W);
  out->gate.opening = static_cast<GateShape::Opening>(in.gate_opening());
  out->gate.inner_half_m = in.gate_inner_half_m();
  out->gate.outer_half_m = in.gate_outer_half_m();
  out->gate.thickness_m = in.gate_thickness_m();
  out->gate_id = in.gate_id();
}

void to_wire(const Course& in, wire::Course* out) {
  out->waypoints().resize(in.waypoints.size());
  for (std::size_t i = 0; i < in.waypoints.size(); ++i) to_wire(in.waypoints[i], &out->waypoints()[i]);
  out->laps(to_unsigned(in.laps));
  out->closed(in.closed);
  out->floor_known(in.floor_z_m.has_value());
  out->floor_z_m(in.floor_z_m.value_or(0.0));
}

void from_wire(const wire::Course& in, Course* out) {
  out->waypoints.resize(in.waypoints().size());
  for (std::size_t i = 0; i < in.waypoints().size(); ++i) from_wire(in.waypoints()[i], &out->waypoints[i]);
  out->laps = to_int(in.laps());
  out->closed = in.closed();
  out->floor_z_m = in.floor_known() ? std::optional(in.floor_z_m()) : std::nullopt;
}

void to_wire(const protocol::PlannerHealth& in, wire::PlannerHealth* out) {
  out->solve_time_s(in.solve_time_s);
  out->effective_samples(in.effective_samples);
  out->lowest_field_m(in.lowest_field_m);
  out->latent_age_s(in.latent_age_s);
  out->state_age_s(in.state_age_s);
  out->target_waypoint(in.target_waypoint);
  out->lap(in.lap);
  out->course_done(in.course_done);
  out->degraded(in.degraded);
  out->problems(in.problems);
}

void from_wire(const wire::PlannerHealth& in, protocol::PlannerHealth* out) {
  out->solve_time_s = in.solve_time_s();
  out->effective_samples = in.effective_samples();
  out->lowest_field_m = in.lowest_field_m();
  out->latent_age_s = in.latent_age_s();
  out->state_age_s = in.state_age_s();
  out->target_waypoint = in.target_waypoint();
  out->lap = in.lap();
  out->course_done = in.course_done();
  out->degraded = in.degraded();
  out->problems = in.problems();
}

}  // namespace

void to_wire(const protocol::SessionRequest& in, wire::SessionRequest* out) {
  out->version(in.version);
  out->vehicle() = in.vehicle;
  out->request(in.request);
  out->action(static_cast<std::uint8_t>(in.action));
  out->timing(static_cast<std::uint8_t>(in.timing));
  out->profile() = in.profile;
  out->seed(in.seed);
  out->speed_limit_m_s(in.speed_limit_m_s);
  out->priority(in.priority);
  to_wire(in.quadrotor, &out->quadrotor());
  to_wire(in.actuation, &out->actuation());
  to_wire(in.camera, &out->camera());
  to_wire(in.course, &out->course());
}

Status from_wire(const wire::SessionRequest& in, protocol::SessionRequest* out) {
  out->version = in.version();
  out->vehicle = in.vehicle().c_str();
  out->request = in.request();
  out->action = static_cast<protocol::SessionRequest::Action>(in.action());
  out->timing = static_cast<protocol::Timing>(in.timing());
  out->profile = in.profile().c_str();
  out->seed = in.seed();
  out->speed_limit_m_s = in.speed_limit_m_s();
  out->priority = in.priority();
  from_wire(in.quadrotor(), &out->quadrotor);
  from_wire(in.actuation(), &out->actuation);
  from_wire(in.camera(), &out->camera);
  from_wire(in.course(), &out->course);
  return protocol::validate(*out);
}

void to_wire(const protocol::SessionReply& in, wire::SessionReply* out) {
  out->version(in.version);
  out->vehicle() = in.vehicle;
  out->request(in.request);
  out->accepted(in.accepted);
  out->reason() = in.reason;
  out->server() = in.server;
  out->session(in.session);
  out->control_period_s(in.control_period_s);
  out->plan_step_s(in.plan_step_s);
  out->plan_steps(to_unsigned(in.plan_steps));
  out->model_hash(in.model_hash);
  out->code(static_cast<std::uint8_t>(in.code));
  out->field() = in.field;
  out->value() = in.value;
  out->expected() = in.expected;
  out->retry_after_s(in.retry_after_s);
  out->heir() = in.heir;
}

Status from_wire(const wire::SessionReply& in, protocol::SessionReply* out) {
  out->version = in.version();
  out->vehicle = in.vehicle().c_str();
  out->request = in.request();
  out->accepted = in.accepted();
  out->reason = in.reason().c_str();
  out->server = in.server().c_str();
  out->session = in.session();
  out->control_period_s = in.control_period_s();
  out->plan_step_s = in.plan_step_s();
  out->plan_steps = to_int(in.plan_steps());
  out->model_hash = in.model_hash();
  out->code = static_cast<ErrorCode>(in.code());
  out->field = in.field().c_str();
  out->value = in.value().c_str();
  out->expected = in.expected().c_str();
  out->retry_after_s = in.retry_after_s();
  out->heir = in.heir();
  return protocol::validate(*out);
}

void to_wire(const protocol::VehicleState& in, wire::VehicleState* out) {
  out->vehicle() = in.vehicle;
  out->session(in.session);
  out->sequence_number(in.sequence);
  out->stamp_ns(in.stamp.count());
  put(in.state.p_WB, &out->p_WB());
  put(in.state.v_WB, &out->v_WB());
  put(Eigen::Vector4d(in.state.q_WB.coeffs()), &out->q_WB());
  put(in.state.w_WB_B, &out->w_WB_B());
  put(in.state.thrust_n, &out->thrust_n());
  put(in.state.thrust_command_n, &out->thrust_command_n());
  out->thrust_known(in.thrust_known);
  out->round_trip_ns(in.round_trip.count());
  out->depth_sequence(in.depth_sequence);
  out->heard_waypoint(in.heard_waypoint);
  out->heard_lap(in.heard_lap);
  out->asked_by(static_cast<std::uint8_t>(in.asked.by));
  out->asked_collective_thrust_n(static_cast<float>(in.asked.command[0]));
  put(Eigen::Vector3d(in.asked.command.tail<3>()), &out->asked_body_rates_rad_s());
}

Status from_wire(const wire::VehicleState& in, protocol::VehicleState* out) {
  out->vehicle = in.vehicle().c_str();
  out->session = in.session();
  out->sequence = in.sequence_number();
  out->stamp = Stamp(in.stamp_ns());
  get(in.p_WB(), &out->state.p_WB);
  get(in.v_WB(), &out->state.v_WB);
  Eigen::Vector4d q_WB;
  get(in.q_WB(), &q_WB);
  out->state.q_WB.coeffs() = q_WB;
  get(in.w_WB_B(), &out->state.w_WB_B);
  get(in.thrust_n(), &out->state.thrust_n);
  get(in.thrust_command_n(), &out->state.thrust_command_n);
  out->thrust_known = in.thrust_known();
  out->round_trip = Stamp(in.round_trip_ns());
  out->depth_sequence = in.depth_sequence();
  out->heard_waypoint = in.heard_waypoint();
  out->heard_lap = in.heard_lap();
  out->asked.by = static_cast<protocol::AskedBy>(in.asked_by());
  Eigen::Vector3d asked_rates_B;
  get(in.asked_body_rates_rad_s(), &asked_rates_B);
  out->asked.command << in.asked_collective_thrust_n(), asked_rates_B;
  Status verdict = protocol::validate(*out);
  if (verdict.ok()) out->state.q_WB.normalize();
  return verdict;
}

void header_to_wire(const protocol::DepthFrame& in, wire::DepthFrame* out) {
  out->vehicle() = in.vehicle;
  out->session(in.session);
  out->sequence_number(in.sequence);
  out->stamp_ns(in.stamp.count());
  out->width_px(in.width_px);
  out->height_px(in.height_px);
  out->encoding(static_cast<std::uint8_t>(in.encoding));
}

Status from_wire(wire::DepthFrame* in, protocol::DepthFrame* out) {
  out->vehicle = in->vehicle().c_str();
  out->session = in->session();
  out->sequence = in->sequence_number();
  out->stamp = Stamp(in->stamp_ns());
  out->width_px = in->width_px();
  out->height_px = in->height_px();
  out->encoding = static_cast<protocol::DepthEncoding>(in->encoding());
  out->pixels.swap(in->pixels());
  CameraModel any;  // of the frame's own size: here the frame is held against itself only
  any.width_px = std::clamp(to_int(out->width_px), 16, 1280);
  any.height_px = std::clamp(to_int(out->height_px), 16, 1280);
  return protocol::validate(*out, any);
}

void to_wire(const protocol::ThrustRateCommand& in, wire::ThrustRateCommand* out) {
  out->vehicle() = in.vehicle;
  out->session(in.session);
  out->sequence_number(in.sequence);
  out->answers_sequence(in.answers_sequence);
  out->answers_stamp_ns(in.answers_stamp.count());
  out->plan_start_ns(in.plan_start.count());
  out->plan_step_ns(in.plan_step.count());
  out->validity_ns(in.validity.count());
  const auto steps = static_cast<std::size_t>(std::clamp(in.steps, 0, protocol::kMaxPlanSteps));
  out->plan().resize(steps);
  for (std::size_t k = 0; k < steps; ++k) {
    wire::PlanStep& step = out->plan()[k];
    put(in.thrust_rate_n_s[k], &step.thrust_rate_n_s());
    put(in.rotor_thrust_n[k], &step.rotor_thrust_n());
    step.collective_thrust_n(static_cast<float>(in.collective_thrust_n[k]));
    put(in.body_rates_rad_s[k], &step.body_rates_rad_s());
  }
  to_wire(in.health, &out->health());
  out->actuation(static_cast<std::uint8_t>(in.actuation));
  out->isa().assign(in.isa.data(), strnlen(in.isa.data(), in.isa.size() - 1));
}

Status from_wire(const wire::ThrustRateCommand& in, protocol::ThrustRateCommand* out) {
  out->vehicle = in.vehicle().c_str();
  out->session = in.session();
  out->sequence = in.sequence_number();
  out->answers_sequence = in.answers_sequence();
  out->answers_stamp = Stamp(in.answers_stamp_ns());
  out->plan_start = Stamp(in.plan_start_ns());
  out->plan_step = Stamp(in.plan_step_ns());
  out->validity = Stamp(in.validity_ns());
  out->steps = static_cast<int>(std::min<std::size_t>(in.plan().size(), 1'000'000));
  const std::size_t kept = std::min<std::size_t>(in.plan().size(), protocol::kMaxPlanSteps);
  for (std::size_t k = 0; k < kept; ++k) {
    const wire::PlanStep& step = in.plan()[k];
    get(step.thrust_rate_n_s(), &out->thrust_rate_n_s[k]);
    get(step.rotor_thrust_n(), &out->rotor_thrust_n[k]);
    out->collective_thrust_n[k] = step.collective_thrust_n();
    get(step.body_rates_rad_s(), &out->body_rates_rad_s[k]);
  }
  from_wire(in.health(), &out->health);
  out->actuation = static_cast<Actuation::Kind>(in.actuation());
  out->isa.fill('\0');
  std::memcpy(out->isa.data(), in.isa().c_str(), std::min(in.isa().size(), out->isa.size() - 1));
  return protocol::validate(*out);
}

void to_wire(const protocol::Telemetry& in, wire::Telemetry* out) {
  out->vehicle() = in.vehicle;
  out->session(in.session);
  out->server_stamp_ns(in.server_stamp.count());
  to_wire(in.health, &out->health());
  out->states_received(in.states_received);
  out->states_rejected(in.states_rejected);
  out->frames_received(in.frames_received);
  out->frames_rejected(in.frames_rejected);
  out->frames_invalid(in.frames_invalid);
  out->commands_sent(in.commands_sent);
  out->deadlines_missed(in.deadlines_missed);
  out->encode_time_s(in.encode_time_s);
  out->found_thrust_factor(in.identified.thrust_factor);
  put(in.identified.rate_time_constant_s, &out->found_rate_time_constant_s());
  put(in.identified.rate_limit_rad_s, &out->found_rate_limit_rad_s());
  out->last_code(static_cast<std::uint8_t>(in.last_code));
  out->last_field() = in.last_field;
  out->last_value() = in.last_value;
  out->last_expected() = in.last_expected;
  out->last_reason() = in.last_reason;
  out->isa() = in.isa;
}

Status from_wire(const wire::Telemetry& in, protocol::Telemetry* out) {
  out->vehicle = in.vehicle().c_str();
  out->session = in.session();
  out->server_stamp = Stamp(in.server_stamp_ns());
  from_wire(in.health(), &out->health);
  out->states_received = in.states_received();
  out->states_rejected = in.states_rejected();
  out->frames_received = in.frames_received();
  out->frames_rejected = in.frames_rejected();
  out->frames_invalid = in.frames_invalid();
  out->commands_sent = in.commands_sent();
  out->deadlines_missed = in.deadlines_missed();
  out->encode_time_s = in.encode_time_s();
  out->identified.thrust_factor = in.found_thrust_factor();
  get(in.found_rate_time_constant_s(), &out->identified.rate_time_constant_s);
  get(in.found_rate_limit_rad_s(), &out->identified.rate_limit_rad_s);
  out->last_code = static_cast<ErrorCode>(in.last_code());
  out->last_field = in.last_field().c_str();
  out->last_value = in.last_value().c_str();
  out->last_expected = in.last_expected().c_str();
  out->last_reason = in.last_reason().c_str();
  out->isa = in.isa().c_str();
  return protocol::validate(*out);
}

void to_wire(const protocol::ServerStatus& in, wire::ServerStatus* out) {
  out->version(in.version);
  out->name() = in.name;
  out->room_cores(in.room_cores);
  out->sessions(in.sessions);
  out->accepts(in.accepts);
  out->isa() = in.isa;
  out->model_hash(in.model_hash);
}

Status from_wire(const wire::ServerStatus& in, protocol::ServerStatus* out) {
  out->version = in.version();
  out->name = in.name().c_str();
  out->room_cores = in.room_cores();
  out->sessions = in.sessions();
  out->accepts = in.accepts();
  out->isa = in.isa().c_str();
  out->model_hash = in.model_hash();
  return protocol::validate(*out);
}

}  // namespace gatefield::dds
