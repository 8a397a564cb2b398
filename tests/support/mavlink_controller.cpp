#include "tests/support/mavlink_controller.h"

#include <algorithm>
#include <array>
#include <bit>

#include "client/firmware/mavlink/constants.h"
#include "client/flight/frames.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using bridge::Dialect;
using mavlink::Command;
using mavlink::CommandResult;

constexpr std::uint64_t kUnixBoot_us = 1'800'000'000'000'000;  // in 2027

mavlink::ParamValue parameter(std::string_view name, double value, mavlink::ParameterType type, Dialect dialect) {
  mavlink::ParamValue message;
  std::ranges::copy(name, message.param_id.begin());
  message.param_type = static_cast<std::uint8_t>(type);
  message.param_value = bridge::encoded_parameter(dialect, value, message.param_type);
  return message;
}

std::string name_of(const mavlink::ParameterName& id) { return {id.begin(), std::find(id.begin(), id.end(), '\0')}; }

}  // namespace

MavlinkController::MavlinkController(std::unique_ptr<firmware::Link> link, Dialect dialect,
                                     const RateController::Options& loop)
    : link_(std::move(link)), dialect_(dialect), loop_(loop) {
  loop_.arm_switch({}, false);
  const auto add = [&](std::string_view name, double value, mavlink::ParameterType type) {
    parameters[std::string(name)] = parameter(name, value, type, dialect);
  };
  if (dialect == Dialect::kPx4) {
    add("COM_OF_LOSS_T", 1.0, mavlink::ParameterType::kFloat);
    add("COM_OBL_RC_ACT", 4, mavlink::ParameterType::kInt32);
  } else if (dialect == Dialect::kArduPilot) {
    add("GUID_OPTIONS", 8, mavlink::ParameterType::kInt32);
    add("GUID_TIMEOUT", 3.0, mavlink::ParameterType::kFloat);
    add("FS_GCS_ENABLE", 5, mavlink::ParameterType::kInt8);
  }
  for (const std::uint32_t always :
       {mavlink::Heartbeat::kId, mavlink::SysStatus::kId, mavlink::ExtendedSysState::kId, mavlink::SystemTime::kId})
    intervals_[always] = 200ms;
}

Stamp MavlinkController::own_time(Stamp now) const { return from_seconds(seconds(now + boot) * clock_rate); }

bool MavlinkController::due(Stamp now, std::uint32_t message) {
  const auto interval = intervals_.find(message);
  if (interval == intervals_.end()) return false;
  const auto last = sent_.find(message);
  if (last != sent_.end() && now - last->second < interval->second) return false;
  sent_[message] = now;
  return true;
}

void MavlinkController::send(const mavlink::Message& message, mavlink::Address from) {
  mavlink::Message bent = message;
  if (bends) bends(&bent);
  if (!silent) link_->send(mavlink::pack(bent, from, sequence_++).bytes());
}

void MavlinkController::serve(Stamp now) {
  std::array<std::uint8_t, firmware::Link::kMaxMessage> buffer{};
  while (const auto transfer = link_->receive(buffer).bytes)
    reader_.read(std::span(buffer).first(transfer), false, [&](const mavlink::Frame& frame) {
      if (const auto message = mavlink::unpack(frame)) take(now, *message);
    });
  send_states(now);
  send_status(now);
}

void MavlinkController::take(Stamp now, const mavlink::Message& message) {
  ++heard[std::visit([]<typename Kind>(const Kind&) { return Kind::kId; }, message)];
  if (const auto* question = std::get_if<mavlink::Timesync>(&message)) {
    if (question->tc1 != 0 || !answers_time) return;
    mavlink::Timesync answer;
    answer.tc1 = own_time(now).count();
    answer.ts1 = question->ts1;
    send(answer);
  } else if (const auto* read = std::get_if<mavlink::ParamRequestRead>(&message)) {
    const auto found = parameters.find(name_of(read->param_id));
    if (found != parameters.end()) send(found->second);
  } else if (const auto* set = std::get_if<mavlink::ParamSet>(&message)) {
    const auto found = parameters.find(name_of(set->param_id));
    if (found == parameters.end()) return;
    found->second.param_value = set->param_value;
    send(found->second);
  } else if (const auto* command = std::get_if<mavlink::CommandLong>(&message)) {
    take(now, *command);
  } else if (const auto* wanted = std::get_if<mavlink::SetAttitudeTarget>(&message)) {
    target = *wanted;
    const Eigen::Vector3d rates_F(static_cast<double>(wanted->body_roll_rate),
                                  static_cast<double>(wanted->body_pitch_rate),
                                  static_cast<double>(wanted->body_yaw_rate));
    loop_.command(now, flight::flu_from_frd(rates_F), static_cast<double>(wanted->thrust));
  }
}

void MavlinkController::take(Stamp now, const mavlink::CommandLong& command) {
  commands.push_back(command);
  if (auto& left = overhears[command.command]; left > 0) {
    --left;
    return;
  }
  mavlink::CommandAck ack;
  ack.command = command.command;
  const auto refusal = refuses.find(command.command);
  ack.result = static_cast<std::uint8_t>(refusal != refuses.end() ? refusal->second : obey(now, command));
  send(ack);
}

CommandResult MavlinkController::obey(Stamp now, const mavlink::CommandLong& command) {
  switch (static_cast<Command>(command.command)) {
    case Command::kDoSetMode: {
      const bool known = command.param1 == 1.0F && command.param2 == bridge::rules(dialect_).mode_number;
      const bool streaming = dialect_ != Dialect::kPx4 || loop_.may_arm(now) || loop_.armed();
      if (!known || !streaming) return CommandResult::kDenied;
      follows_ = true;
      return CommandResult::kAccepted;
    }
    case Command::kArmDisarm:
      if (command.param1 == 0.0F) {
        if (!on_ground && command.param2 != mavlink::kForceDisarm) return CommandResult::kDenied;
        loop_.arm_switch(now, false);
        return CommandResult::kAccepted;
      }
      loop_.arm_switch(now, true);
      return loop_.armed() ? CommandResult::kAccepted : CommandResult::kTemporarilyRejected;
    case Command::kSetMessageInterval: {
      const auto message = static_cast<std::uint32_t>(command.param1);
      if (message == mavlink::Odometry::kId && !sends_odometry) return CommandResult::kUnsupported;
      intervals_[message] = std::chrono::microseconds(static_cast<std::int64_t>(command.param2));
      return CommandResult::kAccepted;
    }
    default:
      return CommandResult::kUnsupported;
  }
}

void MavlinkController::send_states(Stamp now) {
  const Eigen::Vector3d p = flight::ned_from_enu(state.p_WB);
  const Eigen::Vector3d v = flight::ned_from_enu(state.v_WB);
  const Eigen::Quaterniond q = flight::ned_frd_from_enu_flu(Eigen::Quaterniond(state.q_WB));
  const Eigen::Vector3d w = flight::frd_from_flu(state.w_WB_B);
  const auto f = [](double number) { return static_cast<float>(number); };
  const Stamp stamp = own_time(now) + stamps_off;
  const auto boot_ms = static_cast<std::uint32_t>(stamp / 1ms);
  if (due(now, mavlink::Odometry::kId)) {
    const Eigen::Vector3d v_child = child_frame == 12 ? Eigen::Vector3d(q.inverse() * v) : v;
    mavlink::Odometry message;
    message.time_usec = static_cast<std::uint64_t>(stamp / 1us) + (unix_stamps ? kUnixBoot_us : 0);
    message.x = f(p.x()), message.y = f(p.y()), message.z = f(p.z());
    message.q = {f(q.w()), f(q.x()), f(q.y()), f(q.z())};
    message.vx = f(v_child.x()), message.vy = f(v_child.y()), message.vz = f(v_child.z());
    message.rollspeed = f(w.x()), message.pitchspeed = f(w.y()), message.yawspeed = f(w.z());
    message.child_frame_id = child_frame;
    send(message);
  }
  if (due(now, mavlink::LocalPositionNed::kId))
    send(mavlink::LocalPositionNed{boot_ms, f(p.x()), f(p.y()), f(p.z()), f(v.x()), f(v.y()), f(v.z())});
  if (due(now, mavlink::AttitudeQuaternion::kId))
    send(
        mavlink::AttitudeQuaternion{boot_ms, f(q.w()), f(q.x()), f(q.y()), f(q.z()), f(w.x()), f(w.y()), f(w.z()), {}});
  if (due(now, mavlink::HighresImu::kId)) {
    mavlink::HighresImu message;
    message.zacc = f(-specific_force_z);
    message.fields_updated = 0x7;
    send(message);
  }
}

void MavlinkController::send_status(Stamp now) {
  if (due(now, mavlink::Heartbeat::kId)) {
    mavlink::Heartbeat message;
    message.type = 2;
    message.autopilot =
        static_cast<std::uint8_t>(bridge::rules(dialect_).autopilot.value_or(mavlink::AutopilotKind::kGeneric));
    message.base_mode = static_cast<std::uint8_t>((armed() ? mavlink::kModeArmed : 0) | (hil ? mavlink::kModeHil : 0) |
                                                  mavlink::kModeCustom);
    message.system_status = system_status;
    if (follows_ && dialect_ == Dialect::kPx4) message.custom_mode = mavlink::px4_custom_mode(mavlink::kPx4Offboard);
    if (follows_ && dialect_ == Dialect::kArduPilot) message.custom_mode = mavlink::kArduCopterGuided;
    send(message);
  }
  if (due(now, mavlink::SystemTime::kId)) {
    mavlink::SystemTime message;
    message.time_boot_ms = static_cast<std::uint32_t>(own_time(now) / 1ms);
    message.time_unix_usec = kUnixBoot_us + std::uint64_t{message.time_boot_ms} * 1000;
    send(message);
  }
  if (due(now, mavlink::SysStatus::kId)) {
    mavlink::SysStatus message;
    message.voltage_battery = static_cast<std::uint16_t>(battery_v * 1000);
    send(message);
  }
  if (due(now, mavlink::ExtendedSysState::kId)) {
    mavlink::ExtendedSysState message;
    message.landed_state =
        static_cast<std::uint8_t>(on_ground ? mavlink::LandedState::kOnGround : mavlink::LandedState::kInAir);
    send(message);
  }
  if (due(now, mavlink::RcChannels::kId)) {
    mavlink::RcChannels message;
    message.chancount = radio_channels;
    const std::array fields{&mavlink::RcChannels::chan1_raw, &mavlink::RcChannels::chan2_raw,
                            &mavlink::RcChannels::chan3_raw, &mavlink::RcChannels::chan4_raw,
                            &mavlink::RcChannels::chan5_raw, &mavlink::RcChannels::chan6_raw,
                            &mavlink::RcChannels::chan7_raw, &mavlink::RcChannels::chan8_raw};
    for (std::size_t i = 0; i < fields.size() && i < radio_channels; ++i) message.*fields[i] = radio_us[i];
    send(message);
  }
}

}  // namespace gatefield::test
