#include "client/bridge/px4/autopilot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <variant>

#include "client/bridge/mavlink/dialect.h"
#include "client/flight/frames.h"

namespace gatefield::bridge {
namespace {

using flight::Wanted;
using mavlink::AxesFrame;
using mavlink::Command;

OdometerOptions odometry_alone(OdometerOptions options) noexcept {
  options.from = StateFrom::kOdometry;
  return options;
}

std::uint8_t axes_of(std::uint8_t velocity_frame) noexcept {
  switch (static_cast<px4::VelocityFrame>(velocity_frame)) {
    case px4::VelocityFrame::kNed:
      return static_cast<std::uint8_t>(AxesFrame::kLocalNed);
    case px4::VelocityFrame::kFrd:
      return static_cast<std::uint8_t>(AxesFrame::kLocalFrd);
    default:
      return static_cast<std::uint8_t>(AxesFrame::kBodyFrd);
  }
}

/// The same as MAVLink has it, which is what PX4 makes of it for others. @pre validate(message)
mavlink::Odometry as_mavlink(const px4::VehicleOdometry& message) noexcept {
  mavlink::Odometry odometry;
  odometry.x = message.position[0];
  odometry.y = message.position[1];
  odometry.z = message.position[2];
  odometry.q = message.q;
  odometry.vx = message.velocity[0];
  odometry.vy = message.velocity[1];
  odometry.vz = message.velocity[2];
  odometry.rollspeed = message.angular_velocity[0];
  odometry.pitchspeed = message.angular_velocity[1];
  odometry.yawspeed = message.angular_velocity[2];
  odometry.frame_id = static_cast<std::uint8_t>(message.pose_frame == static_cast<std::uint8_t>(px4::PoseFrame::kNed)
                                                    ? AxesFrame::kLocalNed
                                                    : AxesFrame::kLocalFrd);
  odometry.child_frame_id = axes_of(message.velocity_frame);
  odometry.reset_counter = message.reset_counter;
  odometry.quality = message.quality;
  return odometry;
}

}  // namespace

Px4Autopilot::Px4Autopilot(const Px4Config& config, Px4Outlet* outlet) noexcept
    : config_(config), outlet_(outlet), stamps_(config.clock), odometer_(odometry_alone(config.state)) {}

// ---- hearing -------------------------------------------------------------------------------------------------------

void Px4Autopilot::on_message(const Arrival& at, const px4::Message& message) noexcept {
  heard_ = at.now;
  std::visit([&](const auto& content) { on(at, content); }, message);
}

void Px4Autopilot::on(const Arrival& at, const px4::VehicleStatus& message) noexcept {
  const bool ours = status_ ? message.system_id == status_->value.system_id
                            : config_.vehicle_system == 0 || message.system_id == config_.vehicle_system;
  if (ours)
    status_ = {at.now, message};
  else
    stranger_ = {at.now, message.system_id};
}

void Px4Autopilot::on(const Arrival& at, const px4::VehicleOdometry& message) noexcept {
  const std::optional<Stamp> stamp =
      config_.stamps == Stamps::kArrival ? at.now - config_.link_delay : stamps_.ours(at, message.timestamp_sample);
  if (!stamp) return;
  no_state_ = odometer_.on_odometry(at.now, *stamp, as_mavlink(message));
  if (no_state_ == NoState::kNone) attitude_at_ = at.now;
}

void Px4Autopilot::on(const Arrival& at, const px4::VehicleCommandAck& message) noexcept {
  const bool for_us = message.target_system == config_.own_system && message.target_component == config_.own_component;
  if (!for_us || message.command > UINT16_MAX) return;
  mavlink::CommandAck ack;
  ack.command = static_cast<std::uint16_t>(message.command);
  ack.result = message.result;
  desk_.on_ack(at.now, ack);
}

void Px4Autopilot::on(const Arrival& at, const px4::VehicleLandDetected& message) noexcept {
  landed_ = {at.now, message.landed};
}

void Px4Autopilot::on(const Arrival& at, const px4::SensorCombined& message) noexcept {
  if (message.accelerometer_timestamp_relative == px4::SensorCombined::kNoAccelerometer) return;
  force_z_ = {at.now, -static_cast<double>(message.accelerometer_m_s2[2])};  // FRD down, FLU up
}

void Px4Autopilot::on(const Arrival&, const px4::TimesyncStatus& message) noexcept { stamps_.on_timesync(message); }

void Px4Autopilot::on(const Arrival& at, const px4::ManualControlSetpoint& message) noexcept {
  if (config_.radio_from != RadioFrom::kManualControl) return;
  pilot_.reset();
  if (!message.valid) return;
  std::array<std::uint16_t, px4::ManualControlSetpoint::kAuxes> channels_us{};
  std::ranges::transform(message.aux, channels_us.begin(), [](float knob) {
    constexpr float kMiddle_us = 1500.0F, kTravel_us = 500.0F;
    return std::isnan(knob) ? std::uint16_t{0}
                            : static_cast<std::uint16_t>(std::lround(kMiddle_us + kTravel_us * knob));
  });
  pilot_ = {at.now, switches(config_.radio, channels_us)};
}

void Px4Autopilot::on(const Arrival& at, const px4::InputRc& message) noexcept {
  if (config_.radio_from != RadioFrom::kInputRc) return;
  pilot_.reset();
  if (message.rc_lost || message.rc_failsafe || message.channel_count == 0) return;
  pilot_ = {at.now, switches(config_.radio, std::span(message.values).first(message.channel_count))};
}

void Px4Autopilot::on(const Arrival&, const px4::BatteryStatus& message) noexcept {
  if (message.connected && message.voltage_v > 0.0F) battery_v_ = static_cast<double>(message.voltage_v);
}

// ---- speaking ------------------------------------------------------------------------------------------------------

void Px4Autopilot::command(Stamp now, const mavlink::CommandLong& wanted) noexcept {
  const auto due = desk_.want(now, wanted);
  if (!due) return;
  px4::VehicleCommand message;
  message.param1 = due->param1;
  message.param2 = due->param2;
  message.param3 = due->param3;
  message.param4 = due->param4;
  message.param5 = static_cast<double>(due->param5);
  message.param6 = static_cast<double>(due->param6);
  message.param7 = due->param7;
  message.command = due->command;
  message.target_system = status_->value.system_id;
  message.target_component = status_->value.component_id;
  message.source_system = config_.own_system;
  message.source_component = config_.own_component;
  message.confirmation = due->confirmation;
  message.from_external = true;
  outlet_->send(message);
}

void Px4Autopilot::want(Stamp now, Wanted wanted) noexcept {
  if (pursuit_.want(wanted)) {
    desk_.forget(Command::kDoSetMode);
    desk_.forget(Command::kArmDisarm);
  }
  pursue(now);
}

void Px4Autopilot::pursue(Stamp now) noexcept {
  if (!status_) return;
  switch (pursuit_.next(now, armed(), follows())) {
    case Pursuit::Step::kNothing:
      return;
    case Pursuit::Step::kDisarm:
      return command(now, arm_command(false, false));
    case Pursuit::Step::kKill:
      return command(now, arm_command(false, true));
    case Pursuit::Step::kEnterMode:
      if (!stranger(now)) command(now, mode_command(Dialect::kPx4));
      return;
    case Pursuit::Step::kArm:
      if (!stranger(now) && config_.arm_by_command) command(now, arm_command(true, false));
  }
}

void Px4Autopilot::send_setpoint(Stamp now, const Eigen::Vector3d& body_rates_B, double throttle) noexcept {
  if (!status_) return;
  if (!body_rates_B.allFinite() || !(throttle >= 0.0 && throttle <= 1.0)) {
    ++refused_setpoints_;  // no setpoint is better than that one: the firmware's failsafe knows what to do
    return;
  }
  pursuit_.on_setpoint(now);
  px4::OffboardControlMode mode;
  mode.body_rate = true;
  outlet_->send(mode);
  const Eigen::Vector3f rates_F = flight::frd_from_flu(body_rates_B).cast<float>();
  px4::VehicleRatesSetpoint setpoint;
  setpoint.roll = rates_F.x();
  setpoint.pitch = rates_F.y();
  setpoint.yaw = rates_F.z();
  setpoint.thrust_body[2] = static_cast<float>(-throttle);
  outlet_->send(setpoint);
}

// ---- telling -------------------------------------------------------------------------------------------------------

bool Px4Autopilot::armed() const noexcept { return status_->value.arming_state == px4::kArmed; }
bool Px4Autopilot::follows() const noexcept { return status_->value.nav_state == px4::kNavOffboard; }
bool Px4Autopilot::stranger(Stamp now) const noexcept { return stranger_ && now - stranger_->at <= kStrangerGone; }

std::optional<flight::ControllerStatus> Px4Autopilot::status(Stamp now) const noexcept {
  if (!status_) return std::nullopt;
  const px4::VehicleStatus& heard = status_->value;
  flight::ControllerStatus status;
  status.stamp = std::min(*heard_, status_->at + kStatusLost);
  status.armed = armed();
  status.follows_us = follows();
  status.own_failsafe =
      (heard.failsafe && !heard.failsafe_and_user_took_over) || heard.nav_state == px4::kNavTermination;
  if (landed_ && now - landed_->at <= kLandLost) status.on_ground = landed_->value;
  if (pilot_ && now - pilot_->at <= kRadioLost) {
    status.pilot = pilot_->value;
    status.pilot_stamp = pilot_->at;
  }
  status.battery_v = battery_v_;
  if (force_z_ && now - force_z_->at <= kFeltLost) status.specific_force_z_m_s2 = force_z_->value;
  if (attitude_at_ && now - *attitude_at_ <= kFeltLost) status.q_WB = odometer_.attitude();
  status.failsafe = flight::FirmwareFailsafe::kNotChecked;
  return status;
}

Px4Report Px4Autopilot::report(Stamp now) const noexcept {
  Px4Report report;
  if (heard_) report.silent_for = now - *heard_;
  if (status_) {
    report.status = status_->value;
    report.status_age = now - status_->at;
  }
  report.stranger = stranger(now);
  if (stranger_) report.stranger_system = stranger_->value;
  if (config_.stamps == Stamps::kTimeSync) report.clock = stamps_.trouble();
  report.least_age = stamps_.least_age();
  report.own_error = stamps_.own_error();
  report.round_trip = stamps_.round_trip();
  report.states = odometer_.states();
  report.no_state = no_state_;
  report.wrong_age = odometer_.wrong_age();
  report.mode = desk_.fate(Command::kDoSetMode);
  report.arming = desk_.fate(Command::kArmDisarm);
  report.taken_away = pursuit_.taken_away();
  report.refused_setpoints = refused_setpoints_;
  return report;
}

}  // namespace gatefield::bridge
