#include "common/dds/px4/layout.h"

#include <gtest/gtest.h>

#include "common/dds/px4/messages.h"

namespace gatefield::px4 {
namespace {

BusOptions of(Release release) {
  BusOptions options;
  options.release = release;
  return options;
}

TEST(Px4Layout, NamesHaveTheReleasesVersions) {
  EXPECT_EQ(topic_from_px4(of(Release::k1_15), VehicleStatus::kTopic), "rt/fmu/out/vehicle_status");
  EXPECT_EQ(topic_from_px4(of(Release::k1_16), VehicleStatus::kTopic), "rt/fmu/out/vehicle_status_v1");
  EXPECT_EQ(topic_from_px4(of(Release::k1_17), VehicleStatus::kTopic), "rt/fmu/out/vehicle_status_v1");
  EXPECT_EQ(topic_from_px4(of(Release::k1_18), VehicleStatus::kTopic), "rt/fmu/out/vehicle_status_v4");
  EXPECT_EQ(topic_from_px4(of(Release::k1_16), BatteryStatus::kTopic), "rt/fmu/out/battery_status");
  EXPECT_EQ(topic_from_px4(of(Release::k1_17), BatteryStatus::kTopic), "rt/fmu/out/battery_status_v1");
  EXPECT_EQ(topic_from_px4(of(Release::k1_17), VehicleCommandAck::kTopic), "rt/fmu/out/vehicle_command_ack");
  EXPECT_EQ(topic_from_px4(of(Release::k1_18), VehicleCommandAck::kTopic), "rt/fmu/out/vehicle_command_ack_v1");
  EXPECT_EQ(topic_to_px4(of(Release::k1_18), VehicleRatesSetpoint::kTopic), "rt/fmu/in/vehicle_rates_setpoint");
}

TEST(Px4Layout, ANamespaceAndAToldVersionAreInTheName) {
  BusOptions options = of(Release::k1_16);
  options.name_space = "px4_1";
  options.versions["vehicle_status"] = 3;
  EXPECT_EQ(topic_from_px4(options, VehicleStatus::kTopic), "rt/px4_1/fmu/out/vehicle_status_v3");
  EXPECT_EQ(topic_to_px4(options, VehicleCommand::kTopic), "rt/px4_1/fmu/in/vehicle_command");
  options.versions["vehicle_status"] = 0;
  EXPECT_EQ(topic_from_px4(options, VehicleStatus::kTopic), "rt/px4_1/fmu/out/vehicle_status");
}

TEST(Px4Layout, ADifferenceIsToldForTheSameTopicAlone) {
  const BusOptions options = of(Release::k1_16);
  const auto differs = [&](std::string_view name) { return !difference(options, VehicleStatus::kTopic, name).empty(); };
  EXPECT_FALSE(differs("rt/fmu/out/vehicle_status_v1"));
  EXPECT_TRUE(differs("rt/fmu/out/vehicle_status"));
  EXPECT_TRUE(differs("rt/fmu/out/vehicle_status_v4"));
  EXPECT_TRUE(differs("rt/a/b/fmu/out/vehicle_status_v1"));
  EXPECT_FALSE(differs("rt/fmu/out/vehicle_status_flags"));
  EXPECT_FALSE(differs("rt/fmu/out/vehicle_odometry"));
  EXPECT_FALSE(differs("gatefield/telemetry"));
  EXPECT_FALSE(differs(""));
}

TEST(Px4Layout, EveryReleaseHasAName) {
  for (const auto& [text, release] : release_names()) EXPECT_EQ(name(release), text);
}

}  // namespace
}  // namespace gatefield::px4
