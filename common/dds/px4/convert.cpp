#include "common/dds/px4/convert.h"

namespace gatefield::px4 {
namespace {

template <typename Wire>
VehicleStatus status_from(const Wire& in) noexcept {
  VehicleStatus out;
  out.timestamp = in.timestamp();
  out.arming_state = in.arming_state();
  out.nav_state = in.nav_state();
  out.failsafe = in.failsafe();
  out.failsafe_and_user_took_over = in.failsafe_and_user_took_over();
  out.system_id = in.system_id();
  out.component_id = in.component_id();
  out.pre_flight_checks_pass = in.pre_flight_checks_pass();
  return out;
}

template <typename Wire>
InputRc radio_from(const Wire& in) noexcept {
  InputRc out;
  out.timestamp = in.timestamp();
  out.channel_count = in.channel_count();
  out.rc_failsafe = in.rc_failsafe();
  out.rc_lost = in.rc_lost();
  out.values = in.values();
  return out;
}

template <typename Wire>
BatteryStatus battery_from(const Wire& in) noexcept {
  return {in.timestamp(), in.connected(), in.voltage_v()};
}

}  // namespace

void to_wire(const OffboardControlMode& in, wire::OffboardControlMode_* out) noexcept {
  out->timestamp(in.timestamp);
  out->position(in.position);
  out->velocity(in.velocity);
  out->acceleration(in.acceleration);
  out->attitude(in.attitude);
  out->body_rate(in.body_rate);
  out->thrust_and_torque(in.thrust_and_torque);
  out->direct_actuator(in.direct_actuator);
}

void to_wire(const VehicleRatesSetpoint& in, wire::VehicleRatesSetpoint_* out) noexcept {
  out->timestamp(in.timestamp);
  out->roll(in.roll);
  out->pitch(in.pitch);
  out->yaw(in.yaw);
  out->thrust_body(in.thrust_body);
  out->reset_integral(in.reset_integral);
}

void to_wire(const VehicleCommand& in, wire::VehicleCommand_* out) noexcept {
  out->timestamp(in.timestamp);
  out->param1(in.param1);
  out->param2(in.param2);
  out->param3(in.param3);
  out->param4(in.param4);
  out->param5(in.param5);
  out->param6(in.param6);
  out->param7(in.param7);
  out->command(in.command);
  out->target_system(in.target_system);
  out->target_component(in.target_component);
  out->source_system(in.source_system);
  out->source_component(in.source_component);
  out->confirmation(in.confirmation);
  out->from_external(in.from_external);
}

VehicleCommandAck from_wire(const wire::VehicleCommandAck_& in) noexcept {
  VehicleCommandAck out;
  out.timestamp = in.timestamp();
  out.command = in.command();
  out.result = in.result();
  out.result_param1 = in.result_param1();
  out.result_param2 = in.result_param2();
  out.target_system = in.target_system();
  out.target_component = in.target_component();
  out.from_external = in.from_external();
  return out;
}

VehicleOdometry from_wire(const wire::VehicleOdometry_& in) noexcept {
  VehicleOdometry out;
  out.timestamp = in.timestamp();
  out.timestamp_sample = in.timestamp_sample();
  out.pose_frame = in.pose_frame();
  out.position = in.position();
  out.q = in.q();
  out.velocity_frame = in.velocity_frame();
  out.velocity = in.velocity();
  out.angular_velocity = in.angular_velocity();
  out.position_variance = in.position_variance();
  out.orientation_variance = in.orientation_variance();
  out.velocity_variance = in.velocity_variance();
  out.reset_counter = in.reset_counter();
  out.quality = static_cast<std::int8_t>(in.quality());
  return out;
}

VehicleStatus from_wire(const wire::VehicleStatusV0_& in) noexcept { return status_from(in); }
VehicleStatus from_wire(const wire::VehicleStatusV1_& in) noexcept { return status_from(in); }
VehicleStatus from_wire(const wire::VehicleStatusV4_& in) noexcept { return status_from(in); }

VehicleLandDetected from_wire(const wire::VehicleLandDetected_& in) noexcept {
  return {in.timestamp(), in.ground_contact(), in.maybe_landed(), in.landed()};
}

SensorCombined from_wire(const wire::SensorCombined_& in) noexcept {
  return {in.timestamp(), in.gyro_rad(), in.accelerometer_timestamp_relative(), in.accelerometer_m_s2()};
}

TimesyncStatus from_wire(const wire::TimesyncStatus_& in) noexcept {
  TimesyncStatus out;
  out.timestamp = in.timestamp();
  out.source_protocol = in.source_protocol();
  out.remote_timestamp = in.remote_timestamp();
  out.observed_offset = in.observed_offset();
  out.estimated_offset = in.estimated_offset();
  out.round_trip_time = in.round_trip_time();
  return out;
}

ManualControlSetpoint from_wire(const wire::ManualControlSetpoint_& in) noexcept {
  return {in.timestamp(), in.valid(), {in.aux1(), in.aux2(), in.aux3(), in.aux4(), in.aux5(), in.aux6()}};
}

InputRc from_wire(const wire::InputRc_& in) noexcept { return radio_from(in); }
InputRc from_wire(const wire::InputRcWithFrameRate_& in) noexcept { return radio_from(in); }

BatteryStatus from_wire(const wire::BatteryStatusFiltered_& in) noexcept { return battery_from(in); }
BatteryStatus from_wire(const wire::BatteryStatusV0_& in) noexcept { return battery_from(in); }
BatteryStatus from_wire(const wire::BatteryStatusV1_& in) noexcept { return battery_from(in); }

}  // namespace gatefield::px4
