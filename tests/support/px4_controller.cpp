#include "tests/support/px4_controller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/flight/frames.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using mavlink::Command;
using mavlink::CommandResult;

std::array<float, 3> floats(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

bool is(float value, float expected) { return std::abs(value - expected) < 0.5F; }

}  // namespace

Px4Controller::Px4Controller(Say say, const RateController::Options& loop) : say_(std::move(say)), loop_(loop) {
  loop_.arm_switch({}, false);
}

void Px4Controller::hear(Stamp now, const px4::OffboardControlMode& message) {
  mode = message;
  if (message.body_rate) offboard_at_ = now;
}

void Px4Controller::hear(Stamp now, const px4::VehicleRatesSetpoint& message) {
  target = message;
  const Eigen::Vector3d rates_F = Eigen::Vector3f(message.roll, message.pitch, message.yaw).cast<double>();
  loop_.command(now, flight::flu_from_frd(rates_F), -static_cast<double>(message.thrust_body[2]));
}

void Px4Controller::hear(Stamp now, const px4::VehicleCommand& message) {
  if (message.target_system != system && message.target_system != 0) return;
  commands.push_back(message);
  if (auto& left = overhears[message.command]; left > 0) {
    --left;
    return;
  }
  px4::VehicleCommandAck ack;
  ack.timestamp = 1;
  ack.command = message.command;
  const auto refusal = refuses.find(message.command);
  ack.result = static_cast<std::uint8_t>(refusal != refuses.end() ? refusal->second : obey(now, message));
  ack.target_system = message.source_system;
  ack.target_component = message.source_component;
  send(ack);
}

CommandResult Px4Controller::obey(Stamp now, const px4::VehicleCommand& command) {
  switch (static_cast<Command>(command.command)) {
    case Command::kDoSetMode: {
      const bool known = is(command.param1, mavlink::kModeCustom) && is(command.param2, mavlink::kPx4Offboard);
      const bool streaming = offboard_at_ && now - *offboard_at_ <= kOffboardLost;
      if (!known || !streaming) return CommandResult::kDenied;
      nav_state_ = px4::kNavOffboard;
      return CommandResult::kAccepted;
    }
    case Command::kArmDisarm:
      if (is(command.param1, 0.0F)) {
        if (!on_ground && !is(command.param2, mavlink::kForceDisarm)) return CommandResult::kDenied;
        loop_.arm_switch(now, false);
        return CommandResult::kAccepted;
      }
      loop_.arm_switch(now, true);
      return loop_.armed() ? CommandResult::kAccepted : CommandResult::kTemporarilyRejected;
    default:
      return CommandResult::kUnsupported;
  }
}

void Px4Controller::send(px4::Message message) {
  if (bends) bends(&message);
  if (!silent) say_(message);
}

bool Px4Controller::due(Stamp now, std::string_view topic, Stamp interval) {
  const auto last = sent_.find(topic);
  if (last != sent_.end() && now - last->second < interval) return false;
  sent_[topic] = now;
  return true;
}

void Px4Controller::serve(Stamp now, Stamp wall) {
  if (in_failsafe() && follows()) nav_state_ = kDescend;
  const Stamp own = stamps_since_boot ? now + 40s : wall;
  const auto stamp_us = static_cast<std::uint64_t>((own + stamps_off) / 1us);
  send_states(now, stamp_us);
  send_status(now, stamp_us);
}

void Px4Controller::send_states(Stamp now, std::uint64_t stamp_us) {
  if (due(now, px4::VehicleOdometry::kTopic, 10ms)) {
    const Eigen::Quaterniond q = flight::ned_frd_from_enu_flu(Eigen::Quaterniond(state.q_WB));
    const Eigen::Vector3d v = flight::ned_from_enu(state.v_WB);
    px4::VehicleOdometry message;
    message.timestamp = message.timestamp_sample = stamp_us;
    message.position = floats(flight::ned_from_enu(state.p_WB));
    message.q = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                 static_cast<float>(q.z())};
    message.velocity_frame = velocity_frame;
    message.velocity =
        floats(velocity_frame == static_cast<std::uint8_t>(px4::VelocityFrame::kBodyFrd) ? q.inverse() * v : v);
    message.angular_velocity = floats(flight::frd_from_flu(state.w_WB_B));
    send(message);
  }
  if (due(now, px4::SensorCombined::kTopic, 5ms)) {
    px4::SensorCombined message;
    message.timestamp = stamp_us;
    message.accelerometer_m_s2 = {0, 0, static_cast<float>(-specific_force_z)};
    send(message);
  }
}

void Px4Controller::send_status(Stamp now, std::uint64_t stamp_us) {
  if (due(now, px4::VehicleStatus::kTopic, 200ms)) {
    px4::VehicleStatus message;
    message.timestamp = stamp_us;
    message.arming_state = armed() ? px4::kArmed : px4::kDisarmed;
    message.nav_state = nav_state_;
    message.failsafe = in_failsafe();
    message.system_id = system;
    message.pre_flight_checks_pass = true;
    send(message);
  }
  if (due(now, px4::VehicleLandDetected::kTopic, 200ms)) {
    px4::VehicleLandDetected message;
    message.timestamp = stamp_us;
    message.ground_contact = message.maybe_landed = message.landed = on_ground;
    send(message);
  }
  if (due(now, px4::BatteryStatus::kTopic, 1s)) send(px4::BatteryStatus{stamp_us, true, static_cast<float>(battery_v)});
  if (due(now, px4::InputRc::kTopic, 100ms)) {
    px4::InputRc message;
    message.timestamp = stamp_us;
    message.channel_count = radio_channels;
    message.rc_lost = radio_channels == 0;
    message.values = radio_us;
    send(message);
  }
  if (due(now, px4::TimesyncStatus::kTopic, 100ms)) {
    px4::TimesyncStatus message;
    message.timestamp = stamp_us;
    message.round_trip_time = 800;
    send(message);
  }
}

}  // namespace gatefield::test
