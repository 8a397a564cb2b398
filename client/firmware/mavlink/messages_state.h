#pragma once

#include <array>
#include <cstdint>

#include "client/firmware/mavlink/field.h"

/// Messages about where a vehicle is and how it moves. World axes are NED, body axes FRD, quaternions w first, from
/// body to world. Names of fields are those of the definitions (mavlink.io, "MAVLINK common message set").
namespace gatefield::firmware::mavlink {

/// Bounds that no drone of ours comes near: what lies beyond is broken.
inline constexpr double kFarthest_m = 1e5;
inline constexpr double kFastest_m_s = 1e3;
inline constexpr double kFastestTurn_rad_s = 200.0;
inline constexpr double kStrongest_m_s2 = 2000.0;

struct Attitude {
  static constexpr std::uint32_t kId = 30;
  static constexpr std::string_view kName = "ATTITUDE";
  std::uint32_t time_boot_ms = 0;
  float roll = 0, pitch = 0, yaw = 0;                 ///< rad
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;  ///< body rates, FRD, rad/s
  static constexpr auto fields() {
    return std::tuple{field("time_boot_ms", &Attitude::time_boot_ms),
                      field("roll", &Attitude::roll, around_zero(6.2832, "rad")),
                      field("pitch", &Attitude::pitch, around_zero(6.2832, "rad")),
                      field("yaw", &Attitude::yaw, around_zero(6.2832, "rad")),
                      field("rollspeed", &Attitude::rollspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("pitchspeed", &Attitude::pitchspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("yawspeed", &Attitude::yawspeed, around_zero(kFastestTurn_rad_s, "rad/s"))};
  }
};

struct AttitudeQuaternion {
  static constexpr std::uint32_t kId = 31;
  static constexpr std::string_view kName = "ATTITUDE_QUATERNION";
  std::uint32_t time_boot_ms = 0;
  float q1 = 1, q2 = 0, q3 = 0, q4 = 0;               ///< w, x, y, z; their length is checked by validate()
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;  ///< body rates, FRD, rad/s
  std::array<float, 4> repr_offset_q{};               ///< of vehicles that tilt; all 0: none
  static constexpr auto fields() {
    return std::tuple{field("time_boot_ms", &AttitudeQuaternion::time_boot_ms),
                      field("q1", &AttitudeQuaternion::q1, around_zero(1.0 + kQuaternionTolerance)),
                      field("q2", &AttitudeQuaternion::q2, around_zero(1.0 + kQuaternionTolerance)),
                      field("q3", &AttitudeQuaternion::q3, around_zero(1.0 + kQuaternionTolerance)),
                      field("q4", &AttitudeQuaternion::q4, around_zero(1.0 + kQuaternionTolerance)),
                      field("rollspeed", &AttitudeQuaternion::rollspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("pitchspeed", &AttitudeQuaternion::pitchspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("yawspeed", &AttitudeQuaternion::yawspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      extension("repr_offset_q", &AttitudeQuaternion::repr_offset_q)};
  }
};

struct LocalPositionNed {
  static constexpr std::uint32_t kId = 32;
  static constexpr std::string_view kName = "LOCAL_POSITION_NED";
  std::uint32_t time_boot_ms = 0;
  float x = 0, y = 0, z = 0;     ///< NED, m
  float vx = 0, vy = 0, vz = 0;  ///< NED, m/s
  static constexpr auto fields() {
    return std::tuple{field("time_boot_ms", &LocalPositionNed::time_boot_ms),
                      field("x", &LocalPositionNed::x, around_zero(kFarthest_m, "m")),
                      field("y", &LocalPositionNed::y, around_zero(kFarthest_m, "m")),
                      field("z", &LocalPositionNed::z, around_zero(kFarthest_m, "m")),
                      field("vx", &LocalPositionNed::vx, around_zero(kFastest_m_s, "m/s")),
                      field("vy", &LocalPositionNed::vy, around_zero(kFastest_m_s, "m/s")),
                      field("vz", &LocalPositionNed::vz, around_zero(kFastest_m_s, "m/s"))};
  }
};

/// Pose in frame_id, velocity and rates in child_frame_id.
struct Odometry {
  static constexpr std::uint32_t kId = 331;
  static constexpr std::string_view kName = "ODOMETRY";
  std::uint64_t time_usec = 0;                        ///< since boot, or since 1970 (it is large then), us
  float x = 0, y = 0, z = 0;                          ///< m
  std::array<float, 4> q{1, 0, 0, 0};                 ///< child frame to frame, w first
  float vx = 0, vy = 0, vz = 0;                       ///< m/s
  float rollspeed = 0, pitchspeed = 0, yawspeed = 0;  ///< rad/s
  std::array<float, 21> pose_covariance{};            ///< upper triangle; the first NaN: not known
  std::array<float, 21> velocity_covariance{};        ///< upper triangle; the first NaN: not known
  std::uint8_t frame_id = 1;                          ///< AxesFrame
  std::uint8_t child_frame_id = 12;                   ///< AxesFrame
  std::uint8_t reset_counter = 0;                     ///< counts jumps of the estimate
  std::uint8_t estimator_type = 0;
  std::int8_t quality = 0;  ///< %; -1: failed, 0: not known
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &Odometry::time_usec),
                      field("x", &Odometry::x, around_zero(kFarthest_m, "m")),
                      field("y", &Odometry::y, around_zero(kFarthest_m, "m")),
                      field("z", &Odometry::z, around_zero(kFarthest_m, "m")),
                      field("q", &Odometry::q, unit_quaternion()),
                      field("vx", &Odometry::vx, around_zero(kFastest_m_s, "m/s")),
                      field("vy", &Odometry::vy, around_zero(kFastest_m_s, "m/s")),
                      field("vz", &Odometry::vz, around_zero(kFastest_m_s, "m/s")),
                      field("rollspeed", &Odometry::rollspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("pitchspeed", &Odometry::pitchspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("yawspeed", &Odometry::yawspeed, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("pose_covariance", &Odometry::pose_covariance),
                      field("velocity_covariance", &Odometry::velocity_covariance),
                      field("frame_id", &Odometry::frame_id),
                      field("child_frame_id", &Odometry::child_frame_id),
                      extension("reset_counter", &Odometry::reset_counter),
                      extension("estimator_type", &Odometry::estimator_type),
                      extension("quality", &Odometry::quality, within(-1, 100, "%"))};
  }
};

/// What the inertial sensors say, body axes FRD.
struct HighresImu {
  static constexpr std::uint32_t kId = 105;
  static constexpr std::string_view kName = "HIGHRES_IMU";
  std::uint64_t time_usec = 0;            ///< as of Odometry
  float xacc = 0, yacc = 0, zacc = 0;     ///< specific force, m/s2
  float xgyro = 0, ygyro = 0, zgyro = 0;  ///< rad/s
  float xmag = 0, ymag = 0, zmag = 0;     ///< gauss
  float abs_pressure = 0;                 ///< hPa; from PX4 up to 1.16 Pa: more than 2000 of anything is Pa
  float diff_pressure = 0;                ///< hPa
  float pressure_alt = 0;                 ///< m
  float temperature = 0;                  ///< degrees Celsius
  std::uint16_t fields_updated = 0;       ///< one bit for each of the numbers above, in their order
  std::uint8_t id = 0;                    ///< of the sensor
  static constexpr auto fields() {
    return std::tuple{field("time_usec", &HighresImu::time_usec),
                      field("xacc", &HighresImu::xacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("yacc", &HighresImu::yacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("zacc", &HighresImu::zacc, around_zero(kStrongest_m_s2, "m/s2")),
                      field("xgyro", &HighresImu::xgyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("ygyro", &HighresImu::ygyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("zgyro", &HighresImu::zgyro, around_zero(kFastestTurn_rad_s, "rad/s")),
                      field("xmag", &HighresImu::xmag, or_unknown(around_zero(100, "gauss"))),
                      field("ymag", &HighresImu::ymag, or_unknown(around_zero(100, "gauss"))),
                      field("zmag", &HighresImu::zmag, or_unknown(around_zero(100, "gauss"))),
                      field("abs_pressure", &HighresImu::abs_pressure, or_unknown(within(0, 200000, "Pa or hPa"))),
                      field("diff_pressure", &HighresImu::diff_pressure, or_unknown(around_zero(2000, "hPa"))),
                      field("pressure_alt", &HighresImu::pressure_alt, or_unknown(around_zero(kFarthest_m, "m"))),
                      field("temperature", &HighresImu::temperature, or_unknown(within(-274, 500, "degC"))),
                      field("fields_updated", &HighresImu::fields_updated),
                      extension("id", &HighresImu::id)};
  }
};

}  // namespace gatefield::firmware::mavlink
