#include "common/protocol/validate.h"

#include <cmath>
#include <string>

#include "common/base/text.h"

namespace gatefield::protocol {
namespace {

constexpr double kMaxPosition_m = 1e5;
constexpr double kMaxSpeed_m_s = 200.0;
constexpr double kMaxRate_rad_s = 200.0;
constexpr double kMaxThrust_n = 1e4;
constexpr double kMaxThrustRate_n_s = 1e6;
constexpr double kMaxDuration_s = 60.0;
constexpr double kUnitTolerance = 1e-3;

/// Every check below returns this: success costs nothing, a refusal builds its sentence.
Error wrong(const std::string& field, const std::string& value, const std::string& expected) {
  return Error::invalid(field, value, expected);
}

Status check_version(std::uint32_t version) {
  if (version == kVersion) return {};
  return Error::invalid("version", text(version), std::to_string(kVersion) + " (the protocol version of this program)",
                        ErrorCode::kVersion);
}

Status check_stamp(const char* field, Stamp stamp) {
  if (stamp.count() < 0) return wrong(field, text(stamp.count()) + " ns", "at least 0");
  return {};
}

/// A stamp that more times are added to: by half of what its 64 bits hold (146 years) the sums stay far from their end.
Status check_start(const char* field, Stamp stamp) {
  if (stamp.count() < 0 || stamp > Stamp::max() / 2)
    return wrong(field, text(stamp.count()) + " ns", "0 to 2^62 ns (146 years)");
  return {};
}

Status check_positive(const char* field, std::uint64_t value, const char* expected) {
  if (value == 0) return wrong(field, "0", expected);
  return {};
}

template <typename Vector>
Status check_norm(const char* field, const Eigen::MatrixBase<Vector>& v, double limit, const char* expected) {
  if (!v.allFinite() || !(v.norm() < limit)) return wrong(field, text(v), expected);
  return {};
}

template <typename Vector>
Status check_each(const char* field, const Eigen::MatrixBase<Vector>& v, double limit, const char* expected) {
  if (!v.allFinite() || !(v.cwiseAbs().maxCoeff() <= limit)) return wrong(field, text(v), expected);
  return {};
}

Status check_range(const char* field, double value, double low, double high, const char* expected) {
  if (!(value >= low && value <= high)) return wrong(field, text(value), expected);  // also false for NaN
  return {};
}

Status check_text(const char* field, const std::string& value, std::size_t longest) {
  if (value.size() > longest)
    return wrong(field, std::to_string(value.size()) + " characters long", "at most " + std::to_string(longest));
  if (!printable(value)) return wrong(field, "text with control characters", "printable text");
  return {};
}

/// One step of a plan. The rotors of a vehicle that is driven by body rates are its own affair.
Status check_step(const ThrustRateCommand& command, std::size_t k) {
  const bool rates = command.actuation == Actuation::Kind::kBodyRates;
  if (auto s = check_each("thrust_rate_n_s", command.thrust_rate_n_s[k], rates ? 0.0 : kMaxThrustRate_n_s,
                          rates ? "0 in a plan of body rates" : "finite and at most 1e6 N/s");
      !s)
    return s;
  if (auto s = check_each("rotor_thrust_n", command.rotor_thrust_n[k], rates ? 0.0 : kMaxThrust_n,
                          rates ? "0 in a plan of body rates" : "finite and at most 1e4 N");
      !s)
    return s;
  if (auto s = check_range("collective_thrust_n", command.collective_thrust_n[k], rates ? 0.0 : -4 * kMaxThrust_n,
                           4 * kMaxThrust_n, rates ? "0 to 4e4 N" : "finite and at most 4e4 N");
      !s)
    return s;
  return check_norm("body_rates_rad_s", command.body_rates_rad_s[k], kMaxRate_rad_s, "finite and less than 200 rad/s");
}

Status check_health(const PlannerHealth& health) {
  if (auto s = check_range("health.solve_time_s", health.solve_time_s, 0, kMaxDuration_s, "0 to 60 s"); !s) return s;
  if (auto s = check_range("health.effective_samples", health.effective_samples, 0, 1e9, "0 to 1e9"); !s) return s;
  if (auto s = check_range("health.lowest_field_m", health.lowest_field_m, -1e6, 1e6, "a finite distance"); !s)
    return s;
  if (health.latent_age_s != -1.0)
    if (auto s = check_range("health.latent_age_s", health.latent_age_s, 0, 1e9, "-1 (none yet) or at least 0 s"); !s)
      return s;
  if (auto s = check_range("health.state_age_s", health.state_age_s, 0, 1e9, "at least 0 s"); !s) return s;
  if (health.target_waypoint > kMaxWaypoints)
    return wrong("health.target_waypoint", text(health.target_waypoint), "at most " + std::to_string(kMaxWaypoints));
  if (health.lap > kMaxLaps) return wrong("health.lap", text(health.lap), "at most " + std::to_string(kMaxLaps));
  return {};
}

Status check_asked(const Asked& asked) {
  if (asked.by > AskedBy::kUnknown)
    return wrong("asked_by", text(static_cast<int>(asked.by)),
                 "0 (plans), 1 (fallback), 2 (something else) or 3 (nobody knows)");
  if (auto s = check_range("asked_collective_thrust_n", asked.command[0], -kRotors * kMaxThrust_n,
                           kRotors * kMaxThrust_n, "finite and at most 4e4 N");
      !s)
    return s;
  return check_norm("asked_body_rates_rad_s", asked.command.tail<3>(), kMaxRate_rad_s,
                    "finite and less than 200 rad/s");
}

Status check_heard(std::uint32_t waypoint, std::uint32_t lap) {
  if (waypoint > kMaxWaypoints)
    return wrong("heard_waypoint", text(waypoint), "at most " + std::to_string(kMaxWaypoints));
  if (lap > kMaxLaps) return wrong("heard_lap", text(lap), "at most " + std::to_string(kMaxLaps));
  return {};
}

/// Whether the vehicle's body fits through every opening.
Status check_passable(const SessionRequest& request) {
  const double radius_m = request.quadrotor.collision_radius_m;
  for (std::size_t i = 0; i < request.course.waypoints.size(); ++i)
    if (const double inner_half_m = request.course.waypoints[i].gate.inner_half_m; inner_half_m <= radius_m)
      return wrong("course.waypoints[" + std::to_string(i) + "].gate.inner_half_m", text(inner_half_m),
                   "more than the vehicle's collision_radius_m, " + text(radius_m) + " m");
  return {};
}

}  // namespace

bool is_name(std::string_view name) noexcept {
  bool good = !name.empty() && name.size() <= kMaxNameLength;
  for (const char c : name)
    good = good && ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                    c == '.' || c == '-');
  return good;
}

Status validate_name(const char* field, const std::string& name) {
  if (is_name(name)) return {};
  // What was sent is repeated only when it can't do harm where it is shown.
  const std::string shown = name.size() <= kMaxNameLength && printable(name)
                                ? "\"" + name + "\""
                                : "a text of " + std::to_string(name.size()) + " characters";
  return wrong(field, shown, "1 to " + std::to_string(kMaxNameLength) + " of A-Z a-z 0-9 _ . -");
}

Status validate(const SessionRequest& request) {
  // The version first: of another version, nothing else can be relied on.
  if (auto s = check_version(request.version); !s) return s;
  if (auto s = validate_name("vehicle", request.vehicle); !s) return s;
  if (auto s = check_positive("request", request.request, "a number other than 0, new for each start"); !s) return s;
  if (request.action != SessionRequest::Action::kJoin && request.action != SessionRequest::Action::kLeave)
    return wrong("action", text(static_cast<int>(request.action)), "0 (join) or 1 (leave)");
  if (request.action == SessionRequest::Action::kLeave) return {};  // says goodbye; the rest does not matter any more
  if (request.timing != Timing::kRealTime && request.timing != Timing::kLockstep)
    return wrong("timing", text(static_cast<int>(request.timing)), "0 (real time) or 1 (lockstep)");
  if (auto s = validate_name("profile", request.profile); !s) return s;
  if (request.speed_limit_m_s != 0.0)
    if (auto s = check_range("speed_limit_m_s", request.speed_limit_m_s, 0.5, 50.0,
                             "0 (the profile's own) or 0.5 to 50 m/s");
        !s)
      return s;
  if (request.priority > kMaxPriority)
    return wrong("priority", text(static_cast<int>(request.priority)), "0 to " + text(static_cast<int>(kMaxPriority)));
  if (auto s = gatefield::validate(request.quadrotor); !s) return s;
  if (auto s = gatefield::validate(request.actuation); !s) return s;
  if (auto s = gatefield::validate(request.camera); !s) return s;
  if (auto s = gatefield::validate(request.course); !s) return s;
  return check_passable(request);
}

Status validate(const SessionReply& reply) {
  // A refusal is told in the version of who asked.
  if (reply.accepted)
    if (auto s = check_version(reply.version); !s) return s;
  if (auto s = validate_name("vehicle", reply.vehicle); !s) return s;
  if (auto s = check_positive("request", reply.request, "the number of the request it answers"); !s) return s;
  if (auto s = check_text("reason", reply.reason, kMaxReasonLength); !s) return s;
  if (auto s = validate_name("server", reply.server); !s) return s;
  if (auto s = check_text("field", reply.field, kMaxFieldLength); !s) return s;
  if (auto s = check_text("value", reply.value, kMaxFieldLength); !s) return s;
  if (auto s = check_text("expected", reply.expected, kMaxFieldLength); !s) return s;
  if (auto s = check_range("retry_after_s", reply.retry_after_s, 0, kMaxRetryAfter_s, "0 (not known) to 3600 s"); !s)
    return s;
  if (!reply.accepted) {
    if (reply.reason.empty()) return wrong("reason", "empty", "a sentence that says why the session was refused");
    return {};
  }
  if (auto s = check_positive("session", reply.session, "a number other than 0 for an accepted session"); !s) return s;
  if (auto s = check_range("control_period_s", reply.control_period_s, 0.001, 1.0, "0.001 to 1 s"); !s) return s;
  if (auto s = check_range("plan_step_s", reply.plan_step_s, 0.001, 0.2, "0.001 to 0.2 s"); !s) return s;
  if (reply.plan_steps < 1 || reply.plan_steps > kMaxPlanSteps)
    return wrong("plan_steps", text(reply.plan_steps), "1 to " + std::to_string(kMaxPlanSteps));
  return {};
}

Status validate(const VehicleState& state) {
  if (auto s = validate_name("vehicle", state.vehicle); !s) return s;
  if (auto s = check_positive("session", state.session, "the number of an accepted session"); !s) return s;
  if (auto s = check_positive("sequence", state.sequence, "a number from 1, rising"); !s) return s;
  if (auto s = check_stamp("stamp", state.stamp); !s) return s;
  const QuadrotorState& x = state.state;
  if (auto s = check_norm("p_WB", x.p_WB, kMaxPosition_m, "finite and less than 1e5 m from the origin"); !s) return s;
  if (auto s = check_norm("v_WB", x.v_WB, kMaxSpeed_m_s, "finite and less than 200 m/s"); !s) return s;
  if (!x.q_WB.coeffs().allFinite() || !(std::abs(x.q_WB.norm() - 1.0) <= kUnitTolerance))
    return wrong("q_WB", text(x.q_WB.coeffs()) + " of norm " + text(x.q_WB.norm()), "x, y, z, w of norm 1 within 1e-3");
  if (auto s = check_norm("w_WB_B", x.w_WB_B, kMaxRate_rad_s, "finite and less than 200 rad/s"); !s) return s;
  if (auto s = check_each("thrust_n", x.thrust_n, kMaxThrust_n, "finite and at most 1e4 N"); !s) return s;
  if (auto s = check_each("thrust_command_n", x.thrust_command_n, kMaxThrust_n, "finite and at most 1e4 N"); !s)
    return s;
  if (state.round_trip.count() < 0 || seconds(state.round_trip) > kMaxDuration_s)
    return wrong("round_trip", text(seconds(state.round_trip)) + " s", "0 (not measured) to 60 s");
  if (auto s = check_asked(state.asked); !s) return s;
  return check_heard(state.heard_waypoint, state.heard_lap);
}

Status validate(const DepthFrame& frame, const CameraModel& camera) {
  if (auto s = validate_name("vehicle", frame.vehicle); !s) return s;
  if (auto s = check_positive("session", frame.session, "the number of an accepted session"); !s) return s;
  if (auto s = check_positive("sequence", frame.sequence, "a number from 1, rising"); !s) return s;
  if (auto s = check_stamp("stamp", frame.stamp); !s) return s;
  if (frame.width_px != static_cast<std::uint32_t>(camera.width_px) ||
      frame.height_px != static_cast<std::uint32_t>(camera.height_px))
    return wrong("size", text(frame.width_px) + " x " + text(frame.height_px) + " px",
                 text(camera.width_px) + " x " + text(camera.height_px) + " px, the session's camera");
  if (frame.encoding != DepthEncoding::kCounts16 && frame.encoding != DepthEncoding::kMetres32)
    return wrong("encoding", text(static_cast<int>(frame.encoding)), "0 (16-bit counts) or 1 (32-bit metres)");
  const std::size_t expected = std::size_t{frame.width_px} * frame.height_px * bytes_per_pixel(frame.encoding);
  if (frame.pixels.size() != expected)
    return wrong("pixels", std::to_string(frame.pixels.size()) + " bytes",
                 std::to_string(expected) + " bytes for this size and encoding");
  return {};
}

Status validate(const ThrustRateCommand& command) {
  if (auto s = validate_name("vehicle", command.vehicle); !s) return s;
  if (auto s = check_positive("session", command.session, "the number of an accepted session"); !s) return s;
  if (auto s = check_positive("sequence", command.sequence, "a number from 1, rising"); !s) return s;
  if (auto s = check_positive("answers_sequence", command.answers_sequence, "the sequence of a state"); !s) return s;
  if (auto s = check_stamp("answers_stamp", command.answers_stamp); !s) return s;
  if (auto s = check_start("plan_start", command.plan_start); !s) return s;
  if (auto s = check_range("plan_step", seconds(command.plan_step), 0.001, 0.2, "0.001 to 0.2 s"); !s) return s;
  if (auto s = check_range("validity", seconds(command.validity), 0.0, 10.0, "0 to 10 s"); !s) return s;
  if (command.steps < 1 || command.steps > kMaxPlanSteps)
    return wrong("steps", text(command.steps), "1 to " + std::to_string(kMaxPlanSteps));
  if (command.actuation != Actuation::Kind::kRotorThrusts && command.actuation != Actuation::Kind::kBodyRates)
    return wrong("actuation", text(static_cast<int>(command.actuation)), "0 (rotor thrusts) or 1 (body rates)");
  for (int i = 0; i < command.steps; ++i)
    if (auto s = check_step(command, static_cast<std::size_t>(i)); !s)
      return s.failure().within("step " + text(i) + ": ", "plan[" + text(i) + "].");
  if (auto s = check_health(command.health); !s) return s;
  bool terminated = false;
  for (const char c : command.isa) terminated = terminated || c == '\0';
  if (!terminated) return wrong("isa", "16 characters without an end", "a zero-terminated text");
  if (!printable(command.isa.data())) return wrong("isa", "text with control characters", "printable text");
  return {};
}

Status validate(const Telemetry& telemetry) {
  if (auto s = validate_name("vehicle", telemetry.vehicle); !s) return s;
  if (auto s = check_stamp("server_stamp", telemetry.server_stamp); !s) return s;
  if (auto s = check_health(telemetry.health); !s) return s;
  if (auto s = check_range("encode_time_s", telemetry.encode_time_s, 0, kMaxDuration_s, "0 to 60 s"); !s) return s;
  const IdentifiedDrive& found = telemetry.identified;
  if (auto s = check_range("found_thrust_factor", found.thrust_factor, 0, 10, "0 to 10"); !s) return s;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double lag_s = found.rate_time_constant_s[i];
    if (auto s = check_range("found_rate_time_constant_s", lag_s, 0, 10, "0 to 10 s"); !s) return s;
    const double limit_rad_s = found.rate_limit_rad_s[i];
    if (auto s = check_range("found_rate_limit_rad_s", limit_rad_s, 0, kMaxRate_rad_s, "0 to 200 rad/s"); !s) return s;
  }
  if (auto s = check_text("last_field", telemetry.last_field, kMaxFieldLength); !s) return s;
  if (auto s = check_text("last_value", telemetry.last_value, kMaxFieldLength); !s) return s;
  if (auto s = check_text("last_expected", telemetry.last_expected, kMaxFieldLength); !s) return s;
  if (auto s = check_text("last_reason", telemetry.last_reason, kMaxReasonLength); !s) return s;
  return check_text("isa", telemetry.isa, 15);
}

}  // namespace gatefield::protocol
