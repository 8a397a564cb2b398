#include "client/firmware/px4_hil/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/firmware/mavlink/constants.h"
#include "client/firmware/mavlink/messages.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;

SensorOptions quiet() {
  SensorOptions options;
  options.gyro_noise_rad_s_sqrt_hz = options.gyro_bias_rad_s = options.gyro_walk_rad_s2_sqrt_hz = 0;
  options.accel_noise_m_s2_sqrt_hz = options.accel_bias_m_s2 = options.accel_walk_m_s3_sqrt_hz = 0;
  options.mag_noise_gauss = options.baro_noise_hpa = options.gps_position_noise_m = options.gps_velocity_noise_m_s = 0;
  return options;
}

TEST(Sensors, AtRestFeelGravityUpwards) {
  Sensors sensors(quiet(), {});
  const auto sample = sensors.sample(1s, {});
  EXPECT_EQ(sample.time_usec, 1000000U);
  EXPECT_NEAR(sample.xacc, 0.0, 1e-6);
  EXPECT_NEAR(sample.yacc, 0.0, 1e-6);
  EXPECT_NEAR(sample.zacc, -9.81, 1e-5) << "down is positive";
  EXPECT_EQ(sample.xgyro, 0.0F);
}

TEST(Sensors, TurnIntoTheFirmwaresAxes) {
  Sensors sensors(quiet(), {});
  Motion motion;
  motion.w_WB_B = {1, 2, 3};
  motion.specific_force_B = {4, 5, 6};
  const auto sample = sensors.sample(1s, motion);
  EXPECT_EQ(sample.xgyro, 1.0F);
  EXPECT_EQ(sample.ygyro, -2.0F);
  EXPECT_EQ(sample.zgyro, -3.0F);
  EXPECT_EQ(sample.xacc, 4.0F);
  EXPECT_EQ(sample.yacc, -5.0F);
  EXPECT_EQ(sample.zacc, -6.0F);
}

TEST(Sensors, SeeTheEarthsFieldFromTheVehicle) {
  const Site site;
  Sensors sensors(quiet(), site);
  Motion north;  // its nose to the north
  north.q_WB = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  auto sample = sensors.sample(1s, north);
  EXPECT_NEAR(sample.xmag, site.field_N_gauss.x(), 1e-6);
  EXPECT_NEAR(sample.ymag, site.field_N_gauss.y(), 1e-6);
  EXPECT_NEAR(sample.zmag, site.field_N_gauss.z(), 1e-6);
  sample = sensors.sample(2s, {});  // to the east
  EXPECT_NEAR(sample.xmag, site.field_N_gauss.y(), 1e-6);
  EXPECT_NEAR(sample.ymag, -site.field_N_gauss.x(), 1e-6);
}

TEST(Sensors, BarometerFollowsTheStandardAtmosphere) {
  Site site;
  site.altitude_m = 0;
  Sensors sensors(quiet(), site);
  Motion motion;
  EXPECT_NEAR(sensors.sample(1s, motion).abs_pressure, 1013.25, 1e-3);
  motion.p_WB.z() = 1000;
  const auto high = sensors.sample(2s, motion);
  EXPECT_NEAR(high.abs_pressure, 898.75, 0.1);  // tables of the standard atmosphere
  EXPECT_NEAR(high.pressure_alt, 1000.0, 0.1);
  EXPECT_NEAR(high.temperature, 8.5, 1e-3);
}

TEST(Sensors, SatellitesSayWhereAndHowFast) {
  const Site site;
  Sensors sensors(quiet(), site);
  Motion motion;
  motion.p_WB = {100, 200, 30};  // east, north, up
  motion.v_WB = {3, 4, -1};
  const auto fix = sensors.satellites(1s, motion);
  ASSERT_TRUE(fix);
  // A degree of latitude is 111.195 km on this sphere.
  EXPECT_NEAR(fix->lat * 1e-7 - site.latitude_deg, 200.0 / 111194.9, 2e-7);
  EXPECT_NEAR(fix->lon * 1e-7 - site.longitude_deg, 100.0 / (111194.9 * std::cos(site.latitude_deg * M_PI / 180)),
              2e-7);
  EXPECT_EQ(fix->alt, 518000);
  EXPECT_EQ(fix->vn, 400);
  EXPECT_EQ(fix->ve, 300);
  EXPECT_EQ(fix->vd, 100);
  EXPECT_EQ(fix->vel, 500);
  EXPECT_EQ(fix->cog, 3687);
}

TEST(Sensors, ComeAtTheirOwnRates) {
  Sensors sensors({}, {});
  int slow = 0, fixes = 0;
  for (Stamp now = 1s; now < 3s; now += 4ms) {
    const auto sample = sensors.sample(now, {});
    EXPECT_EQ(sample.fields_updated & 0x3FU, 0x3FU);
    slow += (sample.fields_updated & mavlink::kHilBarometer) != 0 ? 1 : 0;
    fixes += sensors.satellites(now, {}) ? 1 : 0;
  }
  EXPECT_EQ(slow, 100);
  EXPECT_EQ(fixes, 20);
}

TEST(Sensors, NoiseHasItsDensityAndBiasStays) {
  SensorOptions options = quiet();
  options.gyro_noise_rad_s_sqrt_hz = 0.01;
  options.gyro_bias_rad_s = 0.2;
  options.seed = 5;
  Sensors sensors(options, {});
  double sum = 0, squares = 0;
  constexpr int kCount = 20000;
  for (int i = 1; i <= kCount; ++i) {
    const auto sample = sensors.sample(i * 4ms, {});
    sum += static_cast<double>(sample.xgyro);
    squares += static_cast<double>(sample.xgyro) * static_cast<double>(sample.xgyro);
  }
  const double mean = sum / kCount;
  EXPECT_NEAR(std::sqrt(squares / kCount - mean * mean), 0.01 / std::sqrt(0.004), 0.003);
  EXPECT_GT(std::abs(mean), 0.005);
  EXPECT_LT(std::abs(mean), 0.8);
  Sensors again(options, {});
  Sensors first(options, {});
  EXPECT_EQ(again.sample(1s, {}).ygyro, first.sample(1s, {}).ygyro) << "the same seed, the same flight";
  options.seed = 6;
  EXPECT_NE(Sensors(options, {}).sample(1s, {}).ygyro, first.sample(2s, {}).ygyro);
}

TEST(Sensors, TruthIsSaidAsItIs) {
  Sensors sensors({}, {});
  Motion motion;
  motion.v_WB = {1, 2, 3};
  const auto truth = sensors.truth(1s, motion);
  EXPECT_EQ(truth.vx, 200);
  EXPECT_EQ(truth.vy, 100);
  EXPECT_EQ(truth.vz, -300);
  EXPECT_EQ(truth.zacc, -1000);
  EXPECT_TRUE(mavlink::validate(truth).ok());
}

TEST(Sensors, OptionsAreChecked) {
  EXPECT_TRUE(validate(SensorOptions{}).ok());
  const std::vector<std::pair<std::string, double SensorOptions::*>> fields{
      {"gyro_noise_rad_s_sqrt_hz", &SensorOptions::gyro_noise_rad_s_sqrt_hz},
      {"gyro_bias_rad_s", &SensorOptions::gyro_bias_rad_s},
      {"gyro_walk_rad_s2_sqrt_hz", &SensorOptions::gyro_walk_rad_s2_sqrt_hz},
      {"accel_noise_m_s2_sqrt_hz", &SensorOptions::accel_noise_m_s2_sqrt_hz},
      {"accel_bias_m_s2", &SensorOptions::accel_bias_m_s2},
      {"accel_walk_m_s3_sqrt_hz", &SensorOptions::accel_walk_m_s3_sqrt_hz},
      {"mag_noise_gauss", &SensorOptions::mag_noise_gauss},
      {"baro_noise_hpa", &SensorOptions::baro_noise_hpa},
      {"gps_position_noise_m", &SensorOptions::gps_position_noise_m},
      {"gps_velocity_noise_m_s", &SensorOptions::gps_velocity_noise_m_s}};
  for (const auto& [name, field] : fields)
    for (const double wrong : {-1.0, 100.0, std::nan("")}) {
      SensorOptions options;
      options.*field = wrong;
      EXPECT_EQ(validate(options).failure().field, name);
    }
  SensorOptions options;
  options.slow_period = 1ms;
  EXPECT_EQ(validate(options).failure().field, "slow_period");
  options = {};
  options.gps_period = 2s;
  EXPECT_EQ(validate(options).failure().field, "gps_period");
}

}  // namespace
}  // namespace gatefield::firmware
