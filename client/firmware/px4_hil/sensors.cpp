#include "client/firmware/px4_hil/sensors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "client/firmware/mavlink/constants.h"
#include "client/flight/frames.h"
#include "common/base/text.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

constexpr double kEarthRadius_m = 6371000.0;
constexpr double kSeaLevel_hpa = 1013.25;
constexpr double kStandardGravity_m_s2 = 9.80665;
constexpr double kDegree = std::numbers::pi / 180.0;

double pressure_hpa(double altitude_m) noexcept {
  return kSeaLevel_hpa * std::pow(1.0 - 2.25577e-5 * altitude_m, 5.25588);
}
double altitude_m(double pressure_hpa) noexcept {
  return (1.0 - std::pow(pressure_hpa / kSeaLevel_hpa, 1.0 / 5.25588)) / 2.25577e-5;
}

std::uint64_t microseconds(Stamp now) noexcept { return static_cast<std::uint64_t>(now / 1us); }

std::int32_t latitude_e7(const Site& site, const Eigen::Vector3d& p_N) noexcept {
  return static_cast<std::int32_t>(std::lround((site.latitude_deg + p_N.x() / kEarthRadius_m / kDegree) * 1e7));
}
std::int32_t longitude_e7(const Site& site, const Eigen::Vector3d& p_N) noexcept {
  const double radius_m = kEarthRadius_m * std::cos(site.latitude_deg * kDegree);
  return static_cast<std::int32_t>(std::lround((site.longitude_deg + p_N.y() / radius_m / kDegree) * 1e7));
}
std::int32_t altitude_mm(const Site& site, const Eigen::Vector3d& p_N) noexcept {
  return static_cast<std::int32_t>(std::lround((site.altitude_m - p_N.z()) * 1e3));
}
std::int16_t cm_s(double speed_m_s) noexcept { return static_cast<std::int16_t>(std::lround(speed_m_s * 100.0)); }

void write(const Eigen::Vector3d& vector, float* x, float* y, float* z) noexcept {
  *x = static_cast<float>(vector.x());
  *y = static_cast<float>(vector.y());
  *z = static_cast<float>(vector.z());
}

struct Bound {
  const char* field;
  double value, most;
};

}  // namespace

Status validate(const SensorOptions& options) {
  for (const Bound& bound :
       {Bound{"gyro_noise_rad_s_sqrt_hz", options.gyro_noise_rad_s_sqrt_hz, 0.1},
        Bound{"gyro_bias_rad_s", options.gyro_bias_rad_s, 0.5},
        Bound{"gyro_walk_rad_s2_sqrt_hz", options.gyro_walk_rad_s2_sqrt_hz, 0.01},
        Bound{"accel_noise_m_s2_sqrt_hz", options.accel_noise_m_s2_sqrt_hz, 1.0},
        Bound{"accel_bias_m_s2", options.accel_bias_m_s2, 2.0},
        Bound{"accel_walk_m_s3_sqrt_hz", options.accel_walk_m_s3_sqrt_hz, 0.1},
        Bound{"mag_noise_gauss", options.mag_noise_gauss, 0.1}, Bound{"baro_noise_hpa", options.baro_noise_hpa, 1.0},
        Bound{"gps_position_noise_m", options.gps_position_noise_m, 10.0},
        Bound{"gps_velocity_noise_m_s", options.gps_velocity_noise_m_s, 2.0}})
    if (!(bound.value >= 0.0 && bound.value <= bound.most))
      return Error::invalid(bound.field, text(bound.value), "0 to " + text(bound.most));
  if (options.slow_period < 5ms || options.slow_period > 200ms)
    return Error::invalid("slow_period", text(seconds(options.slow_period)) + " s", "0.005 to 0.2 s");
  if (options.gps_period < 50ms || options.gps_period > 1s)
    return Error::invalid("gps_period", text(seconds(options.gps_period)) + " s", "0.05 to 1 s");
  return {};
}

Sensors::Sensors(const SensorOptions& options, const Site& site) noexcept
    : options_(options),
      site_(site),
      gyro_random_(options.seed, Stream("gatefield.hil.gyro")),
      accel_random_(options.seed, Stream("gatefield.hil.accelerometer")),
      slow_random_(options.seed, Stream("gatefield.hil.magnetometer_and_barometer")),
      gps_random_(options.seed, Stream("gatefield.hil.satellites")),
      gyro_bias_(normal(&gyro_random_, options.gyro_bias_rad_s)),
      accel_bias_(normal(&accel_random_, options.accel_bias_m_s2)) {}

Eigen::Vector3d Sensors::normal(Random* random, double sigma) noexcept {
  const double x = random->normal();
  const double y = random->normal();
  const double z = random->normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

mavlink::HilSensor Sensors::sample(Stamp now, const Motion& motion) noexcept {
  constexpr double kFirstStep_s = 0.004;
  const double dt_s = last_ && now > *last_ ? seconds(now - *last_) : kFirstStep_s;
  const double root_dt = std::sqrt(dt_s);
  last_ = now;
  gyro_bias_ += normal(&gyro_random_, options_.gyro_walk_rad_s2_sqrt_hz * root_dt);
  accel_bias_ += normal(&accel_random_, options_.accel_walk_m_s3_sqrt_hz * root_dt);
  const Eigen::Vector3d rates_F = flight::frd_from_flu(motion.w_WB_B) + gyro_bias_ +
                                  normal(&gyro_random_, options_.gyro_noise_rad_s_sqrt_hz / root_dt);
  const Eigen::Vector3d force_F = flight::frd_from_flu(motion.specific_force_B) + accel_bias_ +
                                  normal(&accel_random_, options_.accel_noise_m_s2_sqrt_hz / root_dt);
  mavlink::HilSensor& message = newest_;
  message.time_usec = microseconds(now);
  message.fields_updated = mavlink::kHilAccelerometer | mavlink::kHilGyroscope;
  write(rates_F, &message.xgyro, &message.ygyro, &message.zgyro);
  write(force_F, &message.xacc, &message.yacc, &message.zacc);
  if (!slow_at_ || now - *slow_at_ >= options_.slow_period) {
    slow_at_ = now;
    const Eigen::Quaterniond q_NF = flight::ned_frd_from_enu_flu(Eigen::Quaterniond(motion.q_WB));
    const Eigen::Vector3d field_F =
        q_NF.inverse() * site_.field_N_gauss + normal(&slow_random_, options_.mag_noise_gauss);
    write(field_F, &message.xmag, &message.ymag, &message.zmag);
    const double altitude = site_.altitude_m + motion.p_WB.z();
    const double pressure = pressure_hpa(altitude) + options_.baro_noise_hpa * slow_random_.normal();
    message.abs_pressure = static_cast<float>(pressure);
    message.pressure_alt = static_cast<float>(altitude_m(pressure));
    message.temperature = static_cast<float>(15.0 - 0.0065 * altitude);
    message.fields_updated |= mavlink::kHilMagnetometer | mavlink::kHilBarometer;
  }
  return message;
}

std::optional<mavlink::HilGps> Sensors::satellites(Stamp now, const Motion& motion) noexcept {
  if (gps_at_ && now - *gps_at_ < options_.gps_period) return std::nullopt;
  gps_at_ = now;
  const Eigen::Vector3d error = normal(&gps_random_, options_.gps_position_noise_m);
  const Eigen::Vector3d p_N = flight::ned_from_enu(motion.p_WB) + Eigen::Vector3d(error.x(), error.y(), 2 * error.z());
  const Eigen::Vector3d v_N = flight::ned_from_enu(motion.v_WB) + normal(&gps_random_, options_.gps_velocity_noise_m_s);
  mavlink::HilGps message;
  message.time_usec = microseconds(now);
  message.lat = latitude_e7(site_, p_N);
  message.lon = longitude_e7(site_, p_N);
  message.alt = altitude_mm(site_, p_N);
  message.eph = 60;
  message.epv = 90;
  message.vel = static_cast<std::uint16_t>(cm_s(v_N.head<2>().norm()));
  message.vn = cm_s(v_N.x());
  message.ve = cm_s(v_N.y());
  message.vd = cm_s(v_N.z());
  const double course_deg = std::atan2(v_N.y(), v_N.x()) / kDegree;
  message.cog =
      static_cast<std::uint16_t>(std::lround((course_deg < 0 ? course_deg + 360.0 : course_deg) * 100.0) % 36000);
  message.fix_type = 3;
  message.satellites_visible = 16;
  return message;
}

mavlink::HilStateQuaternion Sensors::truth(Stamp now, const Motion& motion) const noexcept {
  const Eigen::Vector3d p_N = flight::ned_from_enu(motion.p_WB);
  const Eigen::Vector3d v_N = flight::ned_from_enu(motion.v_WB);
  const auto q_NF = flight::wxyz(flight::ned_frd_from_enu_flu(Eigen::Quaterniond(motion.q_WB)));
  const Eigen::Vector3d force_F = flight::frd_from_flu(motion.specific_force_B) * (1e3 / kStandardGravity_m_s2);
  mavlink::HilStateQuaternion message;
  message.time_usec = microseconds(now);
  for (std::size_t i = 0; i < 4; ++i) message.attitude_quaternion[i] = static_cast<float>(q_NF[i]);
  write(flight::frd_from_flu(motion.w_WB_B), &message.rollspeed, &message.pitchspeed, &message.yawspeed);
  message.lat = latitude_e7(site_, p_N);
  message.lon = longitude_e7(site_, p_N);
  message.alt = altitude_mm(site_, p_N);
  message.vx = cm_s(v_N.x());
  message.vy = cm_s(v_N.y());
  message.vz = cm_s(v_N.z());
  message.true_airspeed = message.ind_airspeed = static_cast<std::uint16_t>(cm_s(v_N.norm()));
  const auto milli = [](double value) { return static_cast<std::int16_t>(std::lround(std::clamp(value, -3e4, 3e4))); };
  message.xacc = milli(force_F.x());
  message.yacc = milli(force_F.y());
  message.zacc = milli(force_F.z());
  return message;
}

}  // namespace gatefield::firmware
