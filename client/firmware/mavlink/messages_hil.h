#pragma once

#include <array>
#include <cstdint>

#include "client/firmware/mavlink/field.h"
#include "client/firmware/mavlink/messages_state.h"

/// Messages between a simulator and a firmware in its loop. Body axes are FRD, world axes NED. Names of fields are
/// those of the definitions (mavlink.io, "MAVLINK common message set").
namespace gatefield::firmware::mavlink {

/// What the simulated sensors say.
struct HilSensor {
  static constexpr std::uint32_t kId = 107;
  static constexpr std::string_view kName = "HIL_SENSOR";
  std::uint64_t time_usec = 0;            ///< the simulation's, us
  float xacc = 0, yacc = 0, zacc = 0;     ///< specific force, m/s2
  float xgyro = 0, ygyro = 0, zgyro = 0;  ///< rad/s
  float xmag = 0, ymag = 0, zmag = 0;     ///< gauss
  float abs_pressure = 0;                 ///< hPa
  float diff_pressure = 0;                ///< hPa
  float pressure_alt = 0;                 ///< m
  float temperature = 0;                  ///< degrees Celsius
  std::uint32_t fields_updated = 0;       ///< bits kHil...: which of them are new
  std::uint8_t id = 0;                    ///< of the sensor
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &HilSensor::time_usec),
                      field("xacc", &HilSensor::xacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("yacc", &HilSensor::yacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("zacc", &HilSensor::zacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("xgyro", &HilSensor::xgyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("ygyro", &HilSensor::ygyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("zgyro", &HilSensor::zgyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("xmag", &HilSensor::xmag, around_zero(100, "gauss")),
                      field("ymag", &HilSensor::ymag, around_zero(100, "gauss")),
                      field("zmag", &HilSensor::zmag, around_zero(100, "gauss")),
                      field("abs_pressure", &HilSensor::abs_pressure, within(0, 2000, "hPa")),
                      field("diff_pressure", &HilSensor::diff_pressure, around_zero(2000, "hPa")),
                      field("pressure_alt", &HilSensor::pressure_alt, around_zero(kFarthest_m, "m")),
                      field("temperature", &HilSensor::temperature, within(-274, 500, "degC")),
                      field("fields_updated", &HilSensor::fields_updated),
                      extension("id", &HilSensor::id)};
  }
};

/// What the simulated satellite receiver says.
struct HilGps {
  static constexpr std::uint32_t kId = 113;
  static constexpr std::string_view kName = "HIL_GPS";
  std::uint64_t time_usec = 0;
  std::int32_t lat = 0, lon = 0;           ///< degrees * 1e7
  std::int32_t alt = 0;                    ///< above mean sea level, mm
  std::uint16_t eph = 0xFFFF;              ///< dilution of horizontal position * 100; 0xFFFF: not known
  std::uint16_t epv = 0xFFFF;              ///< dilution of vertical position * 100; 0xFFFF: not known
  std::uint16_t vel = 0xFFFF;              ///< speed over ground, cm/s; 0xFFFF: not known
  std::int16_t vn = 0, ve = 0, vd = 0;     ///< cm/s
  std::uint16_t cog = 0xFFFF;              ///< course over ground, 0.01 degrees; 0xFFFF: not known
  std::uint8_t fix_type = 0;               ///< 3: three-dimensional
  std::uint8_t satellites_visible = 0xFF;  ///< 0xFF: not known
  std::uint8_t id = 0;                     ///< of the receiver
  std::uint16_t yaw = 0;                   ///< 0.01 degrees, 36000 is north; 0: not known
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &HilGps::time_usec),
                      field("lat", &HilGps::lat, around_zero(900000000)),
                      field("lon", &HilGps::lon, around_zero(1800000000)),
                      field("alt", &HilGps::alt),
                      field("eph", &HilGps::eph),
                      field("epv", &HilGps::epv),
                      field("vel", &HilGps::vel),
                      field("vn", &HilGps::vn),
                      field("ve", &HilGps::ve),
                      field("vd", &HilGps::vd),
                      field("cog", &HilGps::cog),
                      field("fix_type", &HilGps::fix_type),
                      field("satellites_visible", &HilGps::satellites_visible),
                      extension("id", &HilGps::id),
                      extension("yaw", &HilGps::yaw)};
  }
};

/// The simulator's truth.
struct HilStateQuaternion {
  static constexpr std::uint32_t kId = 115;
  static constexpr std::string_view kName = "HIL_STATE_QUATERNION";
  std::uint64_t time_usec = 0;
  std::array<float, 4> attitude_quaternion{1, 0, 0, 0};  ///< w first
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;     ///< rad/s
  std::int32_t lat = 0, lon = 0;                         ///< degrees * 1e7
  std::int32_t alt = 0;                                  ///< mm
  std::int16_t vx = 0, vy = 0, vz = 0;                   ///< NED, cm/s
  std::uint16_t ind_airspeed = 0;                        ///< cm/s
  std::uint16_t true_airspeed = 0;                       ///< cm/s
  std::int16_t xacc = 0, yacc = 0, zacc = 0;             ///< thousandths of the standard gravity
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &HilStateQuaternion::time_usec),
                      field("attitude_quaternion", &HilStateQuaternion::attitude_quaternion, unit_quaternion()),
                      field("rollspeed", &HilStateQuaternion::rollspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("pitchspeed", &HilStateQuaternion::pitchspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("yawspeed", &HilStateQuaternion::yawspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("lat", &HilStateQuaternion::lat, around_zero(900000000)),
                      field("lon", &HilStateQuaternion::lon, around_zero(1800000000)),
                      field("alt", &HilStateQuaternion::alt),
                      field("vx", &HilStateQuaternion::vx),
                      field("vy", &HilStateQuaternion::vy),
                      field("vz", &HilStateQuaternion::vz),
                      field("ind_airspeed", &HilStateQuaternion::ind_airspeed),
                      field("true_airspeed", &HilStateQuaternion::true_airspeed),
                      field("xacc", &HilStateQuaternion::xacc),
                      field("yacc", &HilStateQuaternion::yacc),
                      field("zacc", &HilStateQuaternion::zacc)};
  }
};

/// What the firmware tells the motors.
struct HilActuatorControls {
  static constexpr std::uint32_t kId = 93;
  static constexpr std::string_view kName = "HIL_ACTUATOR_CONTROLS";
  std::uint64_t time_usec = 0;
  std::uint64_t flags = 0;           ///< kHilLockstep
  std::array<float, 16> controls{};  ///< of the most there is, 0 to 1 of a motor; NaN or 0 of one that is off
  std::uint8_t mode = 0;             ///< bits kMode...
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &HilActuatorControls::time_usec), field("flags", &HilActuatorControls::flags),
                      field("controls", &HilActuatorControls::controls, or_unknown(around_zero(1.001))),
                      field("mode", &HilActuatorControls::mode)};
  }
};

}  // namespace gatefield::firmware::mavlink
