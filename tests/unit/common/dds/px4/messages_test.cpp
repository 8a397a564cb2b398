#include "common/dds/px4/messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace gatefield::px4 {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

template <typename Message>
using Bends = std::vector<std::pair<std::string, std::function<void(Message*)>>>;

template <typename Message>
Message stamped() {
  Message message;
  message.timestamp = 1;
  return message;
}

template <typename Message>
void expect_named(const Message& good, const Bends<Message>& bends) {
  EXPECT_TRUE(validate(good).ok()) << validate(good).error();
  for (const auto& [field, bend] : bends) {
    Message bent = good;
    bend(&bent);
    const Status status = validate(bent);
    ASSERT_FALSE(status.ok()) << field;
    EXPECT_EQ(status.failure().field, std::string(Message::kTopic) + "." + field) << status.error();
    EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
  }
}

TEST(Px4Messages, OdometryOutOfRangeIsNamed) {
  VehicleOdometry good = stamped<VehicleOdometry>();
  good.timestamp_sample = 1;
  Bends<VehicleOdometry> bends{
      {"timestamp", [](auto* m) { m->timestamp = 0; }},
      {"timestamp", [](auto* m) { m->timestamp = UINT64_MAX; }},
      {"timestamp_sample", [](auto* m) { m->timestamp_sample = 0; }},
      {"timestamp_sample", [](auto* m) { m->timestamp_sample = UINT64_MAX; }},
      {"pose_frame", [](auto* m) { m->pose_frame = 0; }},
      {"pose_frame", [](auto* m) { m->pose_frame = 3; }},
      {"velocity_frame", [](auto* m) { m->velocity_frame = 0; }},
      {"velocity_frame", [](auto* m) { m->velocity_frame = 255; }},
      {"q",
       [](auto* m) {
         m->q = {0, 0, 0, 0};
       }},
      {"q",
       [](auto* m) {
         m->q = {1, 1, 0, 0};
       }},
      {"q",
       [](auto* m) {
         m->q = {kNan, 0, 0, 0};
       }},
      {"q", [](auto* m) { m->q[3] = kInfinity; }},
      {"quality", [](auto* m) { m->quality = 101; }},
      {"quality", [](auto* m) { m->quality = -2; }},
  };
  for (std::size_t i = 0; i < 3; ++i)
    for (const float bad : {kNan, kInfinity, -kInfinity, 1e6F}) {
      const std::string index = "[" + std::to_string(i) + "]";
      bends.emplace_back("position" + index, [i, bad](auto* m) { m->position[i] = bad; });
      bends.emplace_back("velocity" + index, [i, bad](auto* m) { m->velocity[i] = bad; });
      bends.emplace_back("angular_velocity" + index, [i, bad](auto* m) { m->angular_velocity[i] = bad; });
    }
  expect_named(good, bends);
}

TEST(Px4Messages, VariancesAreNotLookedAt) {
  VehicleOdometry message = stamped<VehicleOdometry>();
  message.timestamp_sample = 1;
  message.position_variance = message.velocity_variance = message.orientation_variance = {kNan, kNan, kNan};
  EXPECT_TRUE(validate(message).ok());
}

TEST(Px4Messages, StatusOutOfRangeIsNamed) {
  expect_named<VehicleStatus>(stamped<VehicleStatus>(), {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                                         {"arming_state", [](auto* m) { m->arming_state = 0; }},
                                                         {"arming_state", [](auto* m) { m->arming_state = 3; }},
                                                         {"nav_state", [](auto* m) { m->nav_state = 31; }},
                                                         {"system_id", [](auto* m) { m->system_id = 0; }}});
}

TEST(Px4Messages, AcknowledgementsOutOfRangeAreNamed) {
  expect_named<VehicleCommandAck>(stamped<VehicleCommandAck>(), {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                                                 {"result", [](auto* m) { m->result = 10; }}});
}

TEST(Px4Messages, SensorsOutOfRangeAreNamed) {
  Bends<SensorCombined> bends{{"timestamp", [](auto* m) { m->timestamp = 0; }}};
  for (const float bad : {kNan, kInfinity, -kInfinity, 1e5F}) {
    bends.emplace_back("gyro_rad[1]", [bad](auto* m) { m->gyro_rad[1] = bad; });
    bends.emplace_back("accelerometer_m_s2[2]", [bad](auto* m) { m->accelerometer_m_s2[2] = bad; });
  }
  expect_named(stamped<SensorCombined>(), bends);
}

TEST(Px4Messages, TimeSyncOutOfRangeIsNamed) {
  expect_named<TimesyncStatus>(stamped<TimesyncStatus>(),
                               {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                {"observed_offset", [](auto* m) { m->observed_offset = INT64_MIN; }},
                                {"estimated_offset", [](auto* m) { m->estimated_offset = INT64_MAX; }}});
}

TEST(Px4Messages, SwitchesOutOfRangeAreNamed) {
  expect_named<ManualControlSetpoint>(stamped<ManualControlSetpoint>(),
                                      {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                       {"aux1", [](auto* m) { m->aux[0] = 1.5F; }},
                                       {"aux6", [](auto* m) { m->aux[5] = -kInfinity; }}});
  expect_named<InputRc>(stamped<InputRc>(), {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                             {"channel_count", [](auto* m) { m->channel_count = 19; }}});
}

TEST(Px4Messages, TheRestOutOfRangeIsNamed) {
  expect_named<BatteryStatus>(stamped<BatteryStatus>(), {{"timestamp", [](auto* m) { m->timestamp = 0; }},
                                                         {"voltage_v", [](auto* m) { m->voltage_v = -1; }},
                                                         {"voltage_v", [](auto* m) { m->voltage_v = kNan; }},
                                                         {"voltage_v", [](auto* m) { m->voltage_v = 1000; }}});
  expect_named<VehicleLandDetected>(stamped<VehicleLandDetected>(), {{"timestamp", [](auto* m) { m->timestamp = 0; }}});
}

}  // namespace
}  // namespace gatefield::px4
