#include "client/bridge/mavlink/autopilot.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "client/flight/frames.h"

namespace gatefield::bridge {
namespace {

using flight::Wanted;
using mavlink::Address;
using mavlink::Command;

/// Larger stamps count from 1970: it is 2001 then, or the autopilot has been running for 31 years.
constexpr std::uint64_t kUnixFrom_us = 1'000'000'000'000'000;

constexpr double kMillivolt = 1e-3;
constexpr std::uint16_t kNoVoltage = 0xFFFF;

mavlink::CommandLong interval_command(std::uint32_t message, double rate_hz) noexcept {
  mavlink::CommandLong command;
  command.command = static_cast<std::uint16_t>(Command::kSetMessageInterval);
  command.param1 = static_cast<float>(message);
  command.param2 = static_cast<float>(1e6 / rate_hz);
  return command;
}

struct MessageRate {
  std::uint32_t message;
  double rate_hz;  ///< 0: that of the states
};
/// What states and status are made of. Whoever knows one of them not refuses it, and goes without.
constexpr std::array kMessages{
    MessageRate{mavlink::Odometry::kId, 0},           MessageRate{mavlink::LocalPositionNed::kId, 0},
    MessageRate{mavlink::AttitudeQuaternion::kId, 0}, MessageRate{mavlink::HighresImu::kId, 0},
    MessageRate{mavlink::RcChannels::kId, 20},        MessageRate{mavlink::SysStatus::kId, 2},
    MessageRate{mavlink::BatteryStatus::kId, 2},      MessageRate{mavlink::ExtendedSysState::kId, 5},
    MessageRate{mavlink::SystemTime::kId, 1}};

bool wanted_of(StateFrom from, std::uint32_t message) noexcept {
  const bool odometry = message == mavlink::Odometry::kId;
  const bool position = message == mavlink::LocalPositionNed::kId;
  return !(odometry && from == StateFrom::kLocalPosition) && !(position && from == StateFrom::kOdometry);
}

}  // namespace

Autopilot::Autopilot(const MavlinkConfig& config, Outlet* outlet) noexcept
    : config_(config),
      outlet_(outlet),
      time_sync_(config.time_sync),
      odometer_(config.state),
      parameters_(config.dialect, config.may_set_parameters) {}

// ---- hearing -------------------------------------------------------------------------------------------------------

void Autopilot::on_frame(Stamp now, const mavlink::Frame& frame) noexcept {
  if (frame.from == Address{config_.own_system, config_.own_component}) return;  // our own, sent back by a router
  const auto message = mavlink::unpack(frame);
  if (!message) return;
  const auto* const heartbeat = std::get_if<mavlink::Heartbeat>(&*message);
  if (heartbeat == nullptr && frame.from != peer_) return;
  if (const auto fault = mavlink::find_fault(*message)) {
    ++faults_;
    fault_ = fault;
    return;
  }
  if (heartbeat != nullptr) {
    on_heartbeat(frame.from, *heartbeat);
  } else {
    std::visit([&](const auto& content) { on(now, content); }, *message);
  }
  if (frame.from != peer_) return;
  if (now - heard_ > kSilent) begin_anew();
  heard_ = now;
}

void Autopilot::on_heartbeat(Address from, const mavlink::Heartbeat& message) noexcept {
  const bool autopilot = static_cast<mavlink::AutopilotKind>(message.autopilot) != mavlink::AutopilotKind::kInvalid &&
                         static_cast<mavlink::VehicleType>(message.type) != mavlink::VehicleType::kGroundStation;
  if (!peer_) {
    if (!autopilot || (config_.vehicle_system != 0 && from.system != config_.vehicle_system)) return;
    peer_ = from;
  } else if (from != *peer_) {
    return;
  }
  heartbeat_ = message;
}

void Autopilot::begin_anew() noexcept {
  next_message_ = 0;
  parameters_ = Parameters(config_.dialect, config_.may_set_parameters);
  unix_less_boot_us_.reset();
}

void Autopilot::on(Stamp now, const mavlink::Timesync& message) noexcept {
  if (message.tc1 == 0) {
    mavlink::Timesync answer;
    answer.tc1 = now.count();
    answer.ts1 = message.ts1;
    answer.target_system = peer_->system;
    answer.target_component = peer_->component;
    outlet_->send(answer);
    return;
  }
  // Whom an answer is for, its question's time says: PX4 up to 1.16 leaves target_system as memory had it.
  time_sync_.on_answer(now, Stamp{message.ts1}, Stamp{message.tc1});
  if (time_sync_.restarts() != clock_restarts_) {
    clock_restarts_ = time_sync_.restarts();
    begin_anew();
  }
}

void Autopilot::on(Stamp, const mavlink::SystemTime& message) noexcept {
  if (message.time_unix_usec < kUnixFrom_us || message.time_unix_usec > INT64_MAX) return;
  unix_less_boot_us_ = static_cast<std::int64_t>(message.time_unix_usec) - std::int64_t{message.time_boot_ms} * 1000;
}

std::optional<Stamp> Autopilot::translate(Stamp now, std::uint64_t stamp_us) noexcept {
  if (config_.stamps == Stamps::kArrival) return now - config_.link_delay;
  std::optional<Stamp> ours;
  if (stamp_us < kUnixFrom_us) {
    ours = time_sync_.ours(now, std::chrono::microseconds(stamp_us));
  } else if (unix_less_boot_us_ && stamp_us <= static_cast<std::uint64_t>(INT64_MAX) / 1000) {
    ours = time_sync_.ours(now, std::chrono::microseconds(static_cast<std::int64_t>(stamp_us) - *unix_less_boot_us_));
  }
  if (!ours) ++untranslated_;
  return ours;
}

void Autopilot::on(Stamp now, const mavlink::Odometry& message) noexcept {
  const auto stamp = translate(now, message.time_usec);
  if (!stamp) return;
  no_state_ = odometer_.on_odometry(now, *stamp, message);
  if (no_state_ == NoState::kNone) attitude_at_ = now;
}

void Autopilot::on(Stamp now, const mavlink::LocalPositionNed& message) noexcept {
  if (const auto stamp = translate(now, std::uint64_t{message.time_boot_ms} * 1000))
    no_state_ = odometer_.on_position(now, *stamp, message);
}

void Autopilot::on(Stamp now, const mavlink::AttitudeQuaternion& message) noexcept {
  attitude_at_ = now;
  if (const auto stamp = translate(now, std::uint64_t{message.time_boot_ms} * 1000))
    no_state_ = odometer_.on_attitude(now, *stamp, message);
}

void Autopilot::on(Stamp now, const mavlink::HighresImu& message) noexcept {
  constexpr std::uint16_t kZAcceleration = 1 << 2;
  if (message.id == 0 && (message.fields_updated & kZAcceleration) != 0)
    force_z_ = {now, -static_cast<double>(message.zacc)};  // FRD down, FLU up
}

void Autopilot::on(Stamp, const mavlink::SysStatus& message) noexcept {
  if (message.voltage_battery != kNoVoltage && message.voltage_battery != 0)
    battery_v_ = message.voltage_battery * kMillivolt;
}

void Autopilot::on(Stamp, const mavlink::BatteryStatus& message) noexcept {
  if (message.id != 0) return;
  double sum_mv = 0.0;
  for (const std::uint16_t cell : message.voltages)
    if (cell != kNoVoltage) sum_mv += cell;
  for (const std::uint16_t cell : message.voltages_ext) sum_mv += cell;
  if (sum_mv > 0.0) battery_v_ = sum_mv * kMillivolt;
}

void Autopilot::on(Stamp now, const mavlink::RcChannels& message) noexcept {
  if (message.chancount == 0) {
    pilot_.reset();
    return;
  }
  const auto channels = message.channels();
  const std::size_t heard = std::min<std::size_t>(message.chancount, channels.size());
  pilot_ = {now, switches(config_.radio, std::span(channels).first(heard))};
}

void Autopilot::on(Stamp, const mavlink::ExtendedSysState& message) noexcept {
  const auto state = static_cast<mavlink::LandedState>(message.landed_state);
  if (state == mavlink::LandedState::kUnknown)
    on_ground_.reset();
  else
    on_ground_ = state == mavlink::LandedState::kOnGround;
}

void Autopilot::on(Stamp now, const mavlink::CommandAck& message) noexcept {
  const bool for_another = message.target_system != 0 && message.target_system != config_.own_system;
  if (!for_another) desk_.on_ack(now, message);
}

void Autopilot::on(Stamp, const mavlink::ParamValue& message) noexcept { parameters_.on_value(message); }

void Autopilot::on(Stamp, const mavlink::StatusText& message) noexcept {
  if (message.severity <= static_cast<std::uint8_t>(mavlink::Severity::kWarning)) warning_ = message;
}

// ---- speaking ------------------------------------------------------------------------------------------------------

void Autopilot::tick(Stamp now) noexcept {
  if (!heartbeat_sent_ || now - *heartbeat_sent_ >= kHeartbeat) {
    heartbeat_sent_ = now;
    mavlink::Heartbeat heartbeat;
    heartbeat.type = static_cast<std::uint8_t>(mavlink::VehicleType::kOnboardController);
    heartbeat.autopilot = static_cast<std::uint8_t>(mavlink::AutopilotKind::kInvalid);
    heartbeat.system_status = static_cast<std::uint8_t>(mavlink::SystemStatus::kActive);
    outlet_->send(heartbeat);
  }
  if (!peer_) return;
  if (config_.stamps == Stamps::kTimeSync && time_sync_.ask(now)) {
    mavlink::Timesync question;
    question.ts1 = now.count();
    question.target_system = peer_->system;
    question.target_component = peer_->component;
    outlet_->send(question);
  }
  request_parameters(now);
  request_messages(now);
}

void Autopilot::request_parameters(Stamp now) noexcept {
  auto request = parameters_.tick(now);
  if (request.read) {
    request.read->target_system = peer_->system;
    request.read->target_component = peer_->component;
    outlet_->send(*request.read);
  }
  if (request.set) {
    request.set->target_system = peer_->system;
    request.set->target_component = peer_->component;
    outlet_->send(*request.set);
  }
}

void Autopilot::request_messages(Stamp now) noexcept {
  while (next_message_ < kMessages.size() && !wanted_of(config_.state.from, kMessages[next_message_].message))
    ++next_message_;
  if (next_message_ == kMessages.size()) return;
  const auto kind = desk_.fate(Command::kSetMessageInterval).kind;
  if (kind == CommandFate::Kind::kAccepted || kind == CommandFate::Kind::kRefused ||
      kind == CommandFate::Kind::kUnanswered) {
    desk_.forget(Command::kSetMessageInterval);
    ++next_message_;
    return request_messages(now);
  }
  const MessageRate& wanted = kMessages[next_message_];
  command(now, interval_command(wanted.message, wanted.rate_hz > 0 ? wanted.rate_hz : config_.state_rate_hz));
}

void Autopilot::command(Stamp now, mavlink::CommandLong wanted) noexcept {
  wanted.target_system = peer_->system;
  wanted.target_component = peer_->component;
  if (const auto due = desk_.want(now, wanted)) outlet_->send(*due);
}

void Autopilot::want(Stamp now, Wanted wanted) noexcept {
  if (pursuit_.want(wanted)) {
    desk_.forget(Command::kDoSetMode);
    desk_.forget(Command::kArmDisarm);
  }
  if (peer_) pursue(now);
}

void Autopilot::pursue(Stamp now) noexcept {
  const bool may_fly = !wrong_firmware() && parameters_.thrust_is_thrust();
  switch (pursuit_.next(now, armed(), follows())) {
    case Pursuit::Step::kNothing:
      return;
    case Pursuit::Step::kDisarm:
      return command(now, arm_command(false, false));
    case Pursuit::Step::kKill:
      return command(now, arm_command(false, true));
    case Pursuit::Step::kEnterMode:
      // Who has no such mode follows as soon as it is armed.
      if (may_fly && !rules(config_.dialect).mode_name.empty()) return command(now, mode_command(config_.dialect));
      [[fallthrough]];
    case Pursuit::Step::kArm:
      if (may_fly && !armed() && config_.arm_by_command) command(now, arm_command(true, false));
  }
}

void Autopilot::send_setpoint(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept {
  if (!peer_) return;
  if (!body_rates_B.allFinite() || !(throttle >= 0.0 && throttle <= 1.0)) {
    ++refused_setpoints_;  // no setpoint is better than that one: the firmware's failsafe knows what to do
    return;
  }
  pursuit_.on_setpoint(now);
  const Eigen::Vector3d rates = flight::frd_from_flu(body_rates_B);
  mavlink::SetAttitudeTarget target;
  target.time_boot_ms = static_cast<std::uint32_t>(now / std::chrono::milliseconds(1));
  target.body_roll_rate = static_cast<float>(rates.x());
  target.body_pitch_rate = static_cast<float>(rates.y());
  target.body_yaw_rate = static_cast<float>(rates.z());
  target.thrust = static_cast<float>(throttle);
  target.type_mask = mavlink::kIgnoreAttitude;
  target.target_system = peer_->system;
  target.target_component = peer_->component;
  outlet_->send(target);
}

// ---- telling -------------------------------------------------------------------------------------------------------

bool Autopilot::armed() const noexcept { return (heartbeat_.base_mode & mavlink::kModeArmed) != 0; }
bool Autopilot::wrong_firmware() const noexcept {
  const auto expected = rules(config_.dialect).autopilot;
  return peer_ && expected && heartbeat_.autopilot != static_cast<std::uint8_t>(*expected);
}
bool Autopilot::follows() const noexcept { return follows_setpoints(config_.dialect, heartbeat_); }

std::optional<flight::ControllerStatus> Autopilot::status(Stamp now) const noexcept {
  if (!peer_) return std::nullopt;
  flight::ControllerStatus status;
  status.stamp = heard_;
  status.armed = armed();
  status.follows_us = follows();
  const auto system = static_cast<mavlink::SystemStatus>(heartbeat_.system_status);
  status.own_failsafe = system == mavlink::SystemStatus::kCritical || system == mavlink::SystemStatus::kEmergency ||
                        system == mavlink::SystemStatus::kTermination;
  status.on_ground = on_ground_;
  if (pilot_ && now - pilot_->at <= kRadioLost) {
    status.pilot = pilot_->value;
    status.pilot_stamp = pilot_->at;
  }
  status.battery_v = battery_v_;
  if (force_z_ && now - force_z_->at <= kFeltLost) status.specific_force_z_m_s2 = force_z_->value;
  if (attitude_at_ && now - *attitude_at_ <= kFeltLost) status.q_WB = odometer_.attitude();
  status.failsafe = failsafe_of(config_.dialect, parameters_.value(ParameterRule::Use::kTimeout),
                                parameters_.value(ParameterRule::Use::kAction));
  return status;
}

AutopilotReport Autopilot::report(Stamp now) const noexcept {
  AutopilotReport report;
  report.peer = peer_;
  report.heartbeat = heartbeat_;
  report.silent_for = now - heard_;
  report.wrong_firmware = wrong_firmware();
  report.parameters_done = parameters_.done();
  const auto known = rules(config_.dialect).parameters;
  for (std::size_t i = 0; i < known.size(); ++i) report.parameters[i] = parameters_.value(known[i].use);
  report.thrust_is_thrust = parameters_.thrust_is_thrust();
  if (config_.stamps == Stamps::kTimeSync) report.clock = time_sync_.trouble(now);
  report.offset = time_sync_.offset();
  report.round_trip = time_sync_.round_trip();
  report.drift_ppm = time_sync_.drift_ppm();
  report.clock_restarts = time_sync_.restarts();
  report.states = odometer_.states();
  report.no_state = no_state_;
  report.state_age = odometer_.age();
  report.wrong_age = odometer_.wrong_age();
  report.jumps = odometer_.jumps();
  report.untranslated = untranslated_;
  report.mode = desk_.fate(Command::kDoSetMode);
  report.arming = desk_.fate(Command::kArmDisarm);
  report.taken_away = pursuit_.taken_away();
  report.refused_setpoints = refused_setpoints_;
  report.faults = faults_;
  report.fault = fault_;
  report.warning = warning_;
  return report;
}

}  // namespace gatefield::bridge
