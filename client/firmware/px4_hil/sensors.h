#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "client/firmware/mavlink/messages_hil.h"
#include "common/base/clock.h"
#include "common/base/plain.h"
#include "common/base/random.h"
#include "common/base/result.h"

/// The sensors of a simulated vehicle with a firmware in its loop, as MAVLink's HIL messages say them.
namespace gatefield::firmware {

/// Errors of the sensors. Defaults are those of a small flight controller's (an ICM-42688 on soft mounts, a BMP388, an
/// M9N): noise densities of a data sheet times three for what motors shake.
struct SensorOptions {
  double gyro_noise_rad_s_sqrt_hz = 1.5e-4;          ///< density of white noise; 0 to 0.1
  double gyro_bias_rad_s = 0.01;                     ///< deviation of the bias at the start, each axis; 0 to 0.5
  double gyro_walk_rad_s2_sqrt_hz = 1e-5;            ///< of its random walk; 0 to 0.01
  double accel_noise_m_s2_sqrt_hz = 2e-3;            ///< 0 to 1
  double accel_bias_m_s2 = 0.05;                     ///< 0 to 2
  double accel_walk_m_s3_sqrt_hz = 1e-4;             ///< 0 to 0.1
  double mag_noise_gauss = 2e-3;                     ///< deviation of each sample; 0 to 0.1
  double baro_noise_hpa = 0.02;                      ///< 0.02 hPa are 0.17 m; 0 to 1
  double gps_position_noise_m = 0.3;                 ///< horizontal; twice of it vertical; 0 to 10
  double gps_velocity_noise_m_s = 0.05;              ///< 0 to 2
  Stamp slow_period{std::chrono::milliseconds(20)};  ///< of magnetometer and barometer; 5 to 200 ms
  Stamp gps_period{std::chrono::milliseconds(100)};  ///< 50 ms to 1 s
  std::uint64_t seed = 1;
};
/// Says which field is wrong and why.
Status validate(const SensorOptions& options);

/// Where the world's origin lies on the Earth, and the Earth's field there: Zurich, as PX4's own simulations have it,
/// so that its check of the field against its model of the Earth's agrees.
struct Site {
  double latitude_deg = 47.397742;
  double longitude_deg = 8.545594;
  double altitude_m = 488.0;
  Eigen::Vector3d field_N_gauss{0.2176, 0.0114, 0.4277};  ///< NED: 0.48 gauss, 63 degrees down, 3 degrees east
};

/// How the vehicle moves, as the simulator knows it.
struct Motion {
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero(), v_WB = Eigen::Vector3d::Zero();
  PlainQuaternion q_WB = PlainQuaternion::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();
  /// What an accelerometer without error feels, mean since the last sample: (dv/dt + g e_z) turned into B, m/s2.
  Eigen::Vector3d specific_force_B{0, 0, 9.81};
};

/// Inertial sensors at each sample, magnetometer, barometer and satellites at their own periods.
///
///   gyro   w_F + b_g + n_g,   n_g ~ N(0, density^2 / dt),   b_g' = b_g + N(0, walk^2 dt)        (FRD)
///   accel  f_F + b_a + n_a    the same way
///   mag    R(q_NF)^T m_N + noise
///   baro   p = 1013.25 hPa (1 - 2.25577e-5 h)^5.25588, h above mean sea level (standard atmosphere), plus noise;
///          pressure_alt is that h with the same error
///   gps    latitude = latitude_0 + north / R,  longitude = longitude_0 + east / (R cos latitude_0),  R = 6371 km;
///          errors are white
/// All randomness is of streams "gatefield.hil.*" with the options' seed.
/// Thread-safe: no.   Real-time safe: yes.
class Sensors {
 public:
  /// @pre validate(options)
  Sensors(const SensorOptions& options, const Site& site) noexcept;

  /// @param now  of the simulation, rising; the first sample has all sensors in it
  mavlink::HilSensor sample(Stamp now, const Motion& motion) noexcept;
  /// Empty: it is not due. Ask after each sample().
  std::optional<mavlink::HilGps> satellites(Stamp now, const Motion& motion) noexcept;
  /// The truth, for a firmware's log.
  mavlink::HilStateQuaternion truth(Stamp now, const Motion& motion) const noexcept;

 private:
  Eigen::Vector3d normal(Random* random, double sigma) noexcept;

  SensorOptions options_;
  Site site_;
  Random gyro_random_, accel_random_, slow_random_, gps_random_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
  std::optional<Stamp> last_, slow_at_, gps_at_;
  mavlink::HilSensor newest_;
};

}  // namespace gatefield::firmware
