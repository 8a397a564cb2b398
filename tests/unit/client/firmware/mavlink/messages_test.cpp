#include "client/firmware/mavlink/messages.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace gatefield::firmware::mavlink {
namespace {

TEST(Checksum, HasItsPublishedCheckValue) {
  Checksum checksum;
  checksum.add("123456789");
  EXPECT_EQ(checksum.value(), 0x6F91);
}

// id, extra byte, length without extensions, length with them, as the definitions are published.
struct Published {
  std::uint32_t id;
  int crc_extra, base, whole;
};

TEST(Definitions, AreThoseThatArePublished) {
  const std::map<std::string, Published> published{
      {"HEARTBEAT", {0, 50, 9, 9}},
      {"SYS_STATUS", {1, 124, 31, 43}},
      {"SYSTEM_TIME", {2, 137, 12, 12}},
      {"SET_MODE", {11, 89, 6, 6}},
      {"PARAM_REQUEST_READ", {20, 214, 20, 20}},
      {"PARAM_VALUE", {22, 220, 25, 25}},
      {"PARAM_SET", {23, 168, 23, 23}},
      {"ATTITUDE", {30, 39, 28, 28}},
      {"ATTITUDE_QUATERNION", {31, 246, 32, 48}},
      {"LOCAL_POSITION_NED", {32, 185, 28, 28}},
      {"RC_CHANNELS", {65, 118, 42, 42}},
      {"COMMAND_LONG", {76, 152, 33, 33}},
      {"COMMAND_ACK", {77, 143, 3, 10}},
      {"SET_ATTITUDE_TARGET", {82, 49, 39, 51}},
      {"HIL_ACTUATOR_CONTROLS", {93, 47, 81, 81}},
      {"HIGHRES_IMU", {105, 93, 62, 63}},
      {"HIL_SENSOR", {107, 108, 64, 65}},
      {"TIMESYNC", {111, 34, 16, 18}},
      {"HIL_GPS", {113, 124, 36, 39}},
      {"HIL_STATE_QUATERNION", {115, 4, 64, 64}},
      {"BATTERY_STATUS", {147, 154, 36, 54}},
      {"EXTENDED_SYS_STATE", {245, 130, 2, 2}},
      {"STATUSTEXT", {253, 83, 51, 54}},
      {"ODOMETRY", {331, 91, 230, 233}},
  };
  EXPECT_EQ(definitions().size(), published.size());
  for (const Definition& definition : definitions()) {
    const auto found = published.find(std::string(definition.name));
    ASSERT_NE(found, published.end()) << definition.name;
    EXPECT_EQ(definition.id, found->second.id) << definition.name;
    EXPECT_EQ(definition.crc_extra, found->second.crc_extra) << definition.name;
    EXPECT_EQ(definition.base_length, found->second.base) << definition.name;
    EXPECT_EQ(definition.payload_length, found->second.whole) << definition.name;
  }
}

TEST(Definitions, AreFoundByTheirIds) {
  for (const Definition& definition : definitions()) EXPECT_EQ(find_definition(definition.id), &definition);
  EXPECT_EQ(find_definition(3), nullptr);
  EXPECT_EQ(find_definition(0xFFFFFF), nullptr);
}

}  // namespace
}  // namespace gatefield::firmware::mavlink
