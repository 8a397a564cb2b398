#include "client/bridge/mavlink/parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using flight::FirmwareFailsafe;
using mavlink::ParameterType;
using Use = ParameterRule::Use;

constexpr Stamp kBegin = 10s;

mavlink::ParamValue answer(std::string_view name, float value, ParameterType type) {
  mavlink::ParamValue message;
  std::ranges::copy(name, message.param_id.begin());
  message.param_value = value;
  message.param_type = static_cast<std::uint8_t>(type);
  return message;
}

std::string name_of(const mavlink::ParameterName& id) { return {id.data(), strnlen(id.data(), id.size())}; }

/// The bytes of an integer in the float's place.
float bytes_of(std::int32_t value) { return std::bit_cast<float>(value); }

TEST(Parameters, AreReadOneAfterTheOther) {
  Parameters parameters(Dialect::kPx4, false);
  auto request = parameters.tick(kBegin);
  ASSERT_TRUE(request.read);
  EXPECT_EQ(name_of(request.read->param_id), "COM_OF_LOSS_T");
  EXPECT_EQ(request.read->param_index, -1);
  EXPECT_FALSE(parameters.tick(kBegin + 1ms).read) << "it is given time to answer";
  parameters.on_value(answer("COM_OF_LOSS_T", 1.5F, ParameterType::kFloat));
  request = parameters.tick(kBegin + 2ms);
  ASSERT_TRUE(request.read);
  EXPECT_EQ(name_of(request.read->param_id), "COM_OBL_RC_ACT");
  EXPECT_FALSE(parameters.done());
  parameters.on_value(answer("COM_OBL_RC_ACT", bytes_of(4), ParameterType::kInt32));
  EXPECT_TRUE(parameters.done());
  EXPECT_EQ(parameters.value(Use::kTimeout), 1.5);
  EXPECT_EQ(parameters.value(Use::kAction), 4.0);
  EXPECT_TRUE(parameters.thrust_is_thrust());
  EXPECT_FALSE(parameters.tick(kBegin + 10s).read);
}

TEST(Parameters, ThatNeverComeAreGivenUp) {
  Parameters parameters(Dialect::kPx4, false);
  int asked = 0;
  for (Stamp now = kBegin; !parameters.done() && now < kBegin + 60s; now += 10ms)
    asked += parameters.tick(now).read ? 1 : 0;
  EXPECT_TRUE(parameters.done());
  EXPECT_EQ(asked, 2 * Parameters::kTries);
  EXPECT_TRUE(std::isnan(parameters.value(Use::kAction)));
  EXPECT_TRUE(std::isnan(parameters.value(Use::kThrustBit))) << "PX4 has none";
}

TEST(Parameters, IntegersAreAsTheDialectHasThem) {
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(-7), ParameterType::kInt32)), -7.0);
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(250), ParameterType::kUint8)), 250.0);
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(250), ParameterType::kInt8)), -6.0);
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(70000), ParameterType::kUint16)), 4464.0);
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(-2), ParameterType::kInt16)), -2.0);
  EXPECT_EQ(parameter_value(Dialect::kPx4, answer("A", bytes_of(-1), ParameterType::kUint32)), 4294967295.0);
  EXPECT_TRUE(std::isnan(parameter_value(Dialect::kPx4, answer("A", 1.0F, static_cast<ParameterType>(11)))));
  EXPECT_EQ(parameter_value(Dialect::kArduPilot, answer("A", 8.0F, ParameterType::kInt32)), 8.0);
  EXPECT_EQ(std::bit_cast<std::int32_t>(
                encoded_parameter(Dialect::kPx4, -7, static_cast<std::uint8_t>(ParameterType::kInt32))),
            -7);
  EXPECT_EQ(encoded_parameter(Dialect::kArduPilot, 8, static_cast<std::uint8_t>(ParameterType::kInt32)), 8.0F);
}

TEST(Parameters, ThrustBitIsSetWhereThatIsAllowed) {
  Parameters parameters(Dialect::kArduPilot, true);
  ASSERT_TRUE(parameters.tick(kBegin).read);
  EXPECT_FALSE(parameters.thrust_is_thrust()) << "not known yet";
  parameters.on_value(answer("GUID_OPTIONS", 4.0F, ParameterType::kInt32));
  auto request = parameters.tick(kBegin + 1ms);
  ASSERT_TRUE(request.set);
  EXPECT_EQ(name_of(request.set->param_id), "GUID_OPTIONS");
  EXPECT_EQ(request.set->param_value, 12.0F);
  EXPECT_EQ(request.set->param_type, static_cast<std::uint8_t>(ParameterType::kInt32));
  parameters.on_value(answer("GUID_OPTIONS", 4.0F, ParameterType::kInt32));  // a late answer to the reading
  EXPECT_FALSE(parameters.thrust_is_thrust());
  ASSERT_TRUE(parameters.tick(kBegin + 600ms).set);
  parameters.on_value(answer("GUID_OPTIONS", 12.0F, ParameterType::kInt32));
  EXPECT_TRUE(parameters.thrust_is_thrust());
  EXPECT_EQ(name_of(parameters.tick(kBegin + 601ms).read->param_id), "GUID_TIMEOUT");
}

TEST(Parameters, ThrustBitIsLeftAloneWhereItMayNotBeSet) {
  Parameters parameters(Dialect::kArduPilot, false);
  ASSERT_TRUE(parameters.tick(kBegin).read);
  parameters.on_value(answer("GUID_OPTIONS", 0.0F, ParameterType::kInt32));
  EXPECT_FALSE(parameters.tick(kBegin + 1ms).set);
  EXPECT_FALSE(parameters.thrust_is_thrust());
}

TEST(Parameters, OthersAreNoneOfOurs) {
  Parameters parameters(Dialect::kPx4, false);
  ASSERT_TRUE(parameters.tick(kBegin).read);
  parameters.on_value(answer("COM_OF_LOSS_TX", 9.0F, ParameterType::kFloat));
  parameters.on_value(answer("COM_OF", 9.0F, ParameterType::kFloat));
  EXPECT_TRUE(std::isnan(parameters.value(Use::kTimeout)));
}

TEST(Failsafe, IsJudgedByItsTimeAndAction) {
  const double unknown = std::nan("");
  EXPECT_EQ(failsafe_of(Dialect::kPx4, 1.0, 4), FirmwareFailsafe::kGood);
  EXPECT_EQ(failsafe_of(Dialect::kPx4, 1.0, 5), FirmwareFailsafe::kBad) << "hold";
  EXPECT_EQ(failsafe_of(Dialect::kPx4, 30.0, 4), FirmwareFailsafe::kBad);
  EXPECT_EQ(failsafe_of(Dialect::kPx4, unknown, 4), FirmwareFailsafe::kNotChecked);
  EXPECT_EQ(failsafe_of(Dialect::kArduPilot, 3.0, 1), FirmwareFailsafe::kGood);
  EXPECT_EQ(failsafe_of(Dialect::kArduPilot, 3.0, 0), FirmwareFailsafe::kBad);
  EXPECT_EQ(failsafe_of(Dialect::kArduPilot, 3.0, unknown), FirmwareFailsafe::kNotChecked);
  EXPECT_EQ(failsafe_of(Dialect::kPlain, 3.0, 1), FirmwareFailsafe::kNotChecked);
}

TEST(Dialect, SaysWhenSetpointsAreFollowed) {
  mavlink::Heartbeat heartbeat;
  heartbeat.base_mode = mavlink::kModeCustom;
  heartbeat.custom_mode = mavlink::px4_custom_mode(mavlink::kPx4Offboard);
  EXPECT_TRUE(follows_setpoints(Dialect::kPx4, heartbeat));
  heartbeat.custom_mode = mavlink::px4_custom_mode(3);
  EXPECT_FALSE(follows_setpoints(Dialect::kPx4, heartbeat));
  heartbeat.custom_mode = mavlink::kArduCopterGuided;
  EXPECT_TRUE(follows_setpoints(Dialect::kArduPilot, heartbeat));
  EXPECT_FALSE(follows_setpoints(Dialect::kPx4, heartbeat));
  heartbeat.base_mode = 0;
  EXPECT_FALSE(follows_setpoints(Dialect::kArduPilot, heartbeat)) << "a mode of somebody else's counting";
  EXPECT_FALSE(follows_setpoints(Dialect::kPlain, heartbeat));
  heartbeat.base_mode = mavlink::kModeArmed;
  EXPECT_TRUE(follows_setpoints(Dialect::kPlain, heartbeat));
}

}  // namespace
}  // namespace gatefield::bridge
