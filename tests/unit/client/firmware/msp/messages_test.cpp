#include "client/firmware/msp/messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>

namespace gatefield::firmware::msp {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A payload written field by field.
class Written {
 public:
  Written& u8(int value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    return *this;
  }
  Written& u16(int value) { return u8(value & 0xFF).u8(value >> 8 & 0xFF); }
  Written& u32(std::uint32_t value) { return u16(static_cast<int>(value & 0xFFFF)).u16(static_cast<int>(value >> 16)); }
  operator Payload() const { return bytes; }  // NOLINT(google-explicit-constructor)
  std::vector<std::uint8_t> bytes;
};

Written attitude(int roll, int pitch, int yaw) { return Written().u16(roll).u16(pitch).u16(yaw); }

Written status(std::uint32_t modes, int more_mode_bytes, int reasons, std::uint32_t disabled) {
  Written payload = Written().u16(125).u16(0).u16(0x21).u32(modes).u8(0).u16(17).u16(0).u8(more_mode_bytes);
  for (int i = 0; i < (more_mode_bytes & 15); ++i) payload.u8(0xAA);
  return payload.u8(reasons).u32(disabled).u8(0).u16(0);
}

struct Tuning {
  int limit_type = 0, limit_percent = 100, mid = 50, expo = 0, rate_limit = 1998, type = 3, axis_expo = 30;
};
Written rc_tuning(const Tuning& t) {
  return Written()
      .u8(7)
      .u8(t.axis_expo)
      .u8(67)
      .u8(68)
      .u8(69)
      .u8(0)
      .u8(t.mid)
      .u8(t.expo)
      .u16(0)
      .u8(12)
      .u8(9)
      .u8(8)
      .u8(11)
      .u8(t.limit_type)
      .u8(t.limit_percent)
      .u16(t.rate_limit)
      .u16(1500)
      .u16(1000)
      .u8(t.type);
}

Written rx_config(int max_check, int mid, int min_check, int shortest, int longest) {
  return Written().u8(0).u16(max_check).u16(mid).u16(min_check).u8(0).u16(shortest).u16(longest);
}

/// One message, in a form that is right: what every message has to stand.
struct Message {
  const char* name;
  std::vector<std::uint8_t> right;
  std::size_t needed;  ///< bytes of it that must be there
  std::function<bool(Payload)> read;
};
std::vector<Message> messages() {
  return {
      {"api", Written().u8(0).u8(1).u8(46).bytes, 3, [](Payload p) { return read_api_version(p).has_value(); }},
      {"variant", {'B', 'T', 'F', 'L'}, 4, [](Payload p) { return !read_variant(p).empty(); }},
      {"version", {4, 5, 1}, 3, [](Payload p) { return read_firmware_version(p).has_value(); }},
      {"status", status(1, 2, 26, 0).bytes, 23, [](Payload p) { return read_status(p).has_value(); }},
      {"attitude", attitude(10, 20, 30).bytes, 6, [](Payload p) { return read_attitude(p).has_value(); }},
      {"imu", std::vector<std::uint8_t>(18, 1), 12, [](Payload p) { return read_raw_imu(p).has_value(); }},
      {"battery", Written().u8(4).u16(1300).u8(160).u16(10).u16(100).u8(0).u16(1600).bytes, 11,
       [](Payload p) { return read_battery(p).has_value(); }},
      {"rc", std::vector<std::uint8_t>(8, 5), 8, [](Payload p) { return read_rc(p).has_value(); }},
      {"motors", std::vector<std::uint8_t>(16, 4), 16, [](Payload p) { return read_motors(p).has_value(); }},
      {"tuning", rc_tuning({}).bytes, 23, [](Payload p) { return read_rc_tuning(p).has_value(); }},
      {"rx", rx_config(1900, 1500, 1050, 885, 2115).bytes, 12, [](Payload p) { return read_rx_config(p).has_value(); }},
      {"map", {0, 1, 3, 2, 4, 5, 6, 7}, 8, [](Payload p) { return read_rx_map(p).has_value(); }},
      {"deadband", {3, 5}, 2, [](Payload p) { return read_rc_deadband(p).has_value(); }},
      {"failsafe", Written().u8(15).u8(10).u16(1000).u8(0).u16(100).u8(1).bytes, 8,
       [](Payload p) { return read_failsafe(p).has_value(); }},
      {"features", Written().u32(kFeatureRxMsp).bytes, 4, [](Payload p) { return read_features(p).has_value(); }},
      {"mixer", {3, 1}, 2, [](Payload p) { return read_mixer(p).has_value(); }},
  };
}

TEST(MspMessages, AreReadWholeAndWithWhatLaterVersionsAppend) {
  for (const Message& message : messages()) {
    EXPECT_TRUE(message.read(message.right)) << message.name;
    auto longer = message.right;
    longer.insert(longer.end(), 8, 0xFF);
    EXPECT_TRUE(message.read(longer)) << message.name;
  }
}

TEST(MspMessages, CutAnywhereGiveNothing) {
  for (const Message& message : messages()) {
    ASSERT_LE(message.needed, message.right.size()) << message.name;
    for (std::size_t size = 0; size < message.needed; ++size)
      EXPECT_FALSE(message.read(Payload(message.right).first(size))) << message.name << " " << size;
    EXPECT_TRUE(message.read(Payload(message.right).first(message.needed))) << message.name;
  }
}

TEST(MspMessages, AnyBytesAreTakenOrNotButNeverReadBeyond) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(0, 255), size(0, 60);
  for (int round = 0; round < 20000; ++round) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size(random)));
    for (auto& value : bytes) value = static_cast<std::uint8_t>(byte(random));
    for (const Message& message : messages()) (void)message.read(bytes);
    (void)read_mode_ranges(bytes);
    (void)read_box_ids(bytes);
  }
}

TEST(MspMessages, VersionsOfYearsAreYears) {
  EXPECT_EQ(read_firmware_version(std::vector<std::uint8_t>{4, 5, 2}), (FirmwareVersion{4, 5, 2}));
  EXPECT_EQ(read_firmware_version(std::vector<std::uint8_t>{25, 12, 1}), (FirmwareVersion{2025, 12, 1}));
  EXPECT_LT((FirmwareVersion{4, 5, 9}), (FirmwareVersion{2025, 12, 0}));
  EXPECT_EQ(read_variant(std::vector<std::uint8_t>{'B', 'T', '\n', 'L'}), "") << "not for a log";
}

TEST(MspMessages, AttitudeIsThatOfAviation) {
  const auto read = read_attitude(attitude(-123, 456, 270));  // left, nose down, west
  ASSERT_TRUE(read.has_value());
  EXPECT_NEAR(read->roll_rad, -12.3 * kDegree, 1e-12);
  EXPECT_NEAR(read->pitch_rad, -45.6 * kDegree, 1e-12);
  EXPECT_NEAR(read->yaw_rad, 270 * kDegree, 1e-12);
  EXPECT_TRUE(read_attitude(attitude(1800, 900, 359)).has_value());
  for (const auto& wrong : {attitude(1801, 0, 0), attitude(-1801, 0, 0), attitude(0, 901, 0), attitude(0, -901, 0),
                            attitude(0, 0, -1), attitude(0, 0, 361)})
    EXPECT_FALSE(read_attitude(wrong).has_value());
}

TEST(MspMessages, StatusSaysModesAndWhyItDoesNotArm) {
  const auto read = read_status(status(0x5, 3, 26, 1u << 7 | 1u << 25));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->modes, 0x5u);
  EXPECT_EQ(read->load_percent, 17);
  EXPECT_EQ(read->sensors, 0x21);
  EXPECT_EQ(read->arming_disabled, 1u << kNotArmedThrottle);
  EXPECT_TRUE(read->arm_switch_waits);
  EXPECT_THAT(why_not_armed(kNotArmedThrottle), HasSubstr("throttle"));

  const auto later = read_status(status(0, 0, 30, 1u << 25 | 1u << 29));  // 2026: more reasons before the switch
  ASSERT_TRUE(later.has_value());
  EXPECT_EQ(later->arming_disabled, 1u << 25);
  EXPECT_TRUE(later->arm_switch_waits);

  EXPECT_FALSE(read_status(status(0, 0, 0, 0)).has_value());
  EXPECT_FALSE(read_status(status(0, 0, 33, 0)).has_value());
}

TEST(MspMessages, EveryReasonHasASentenceWithWhatToDo) {
  for (int bit = -1; bit < 33; ++bit) EXPECT_GT(std::string_view(why_not_armed(bit)).size(), 20u) << bit;
  EXPECT_THAT(why_not_armed(kNotArmedRxFailsafe), HasSubstr("receiver"));
  EXPECT_THAT(why_not_armed(kNotArmedCli), HasSubstr("command line"));
  EXPECT_THAT(why_not_armed(24), HasSubstr("motor_pwm_protocol"));
}

TEST(MspMessages, BatteryHasUnits) {
  const auto read = read_battery(Written().u8(4).u16(1300).u8(160).u16(250).u16(-150).u8(1).u16(1587));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->cells, 4);
  EXPECT_DOUBLE_EQ(read->voltage_v, 15.87);
  EXPECT_DOUBLE_EQ(read->current_a, -1.5);
  EXPECT_DOUBLE_EQ(read->drawn_ah, 0.25);
  EXPECT_EQ(read->state, Battery::State::kWarning);
  EXPECT_FALSE(read_battery(Written().u8(4).u16(1300).u8(160).u16(250).u16(0).u8(5).u16(1587)).has_value());
}

TEST(MspMessages, RatesOfEachAxisStandWhereTheyBelong) {
  const auto read = read_rc_tuning(rc_tuning({.limit_type = 1, .limit_percent = 80, .mid = 40, .expo = 20}));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->axes[0].rc_rate, 7);
  EXPECT_EQ(read->axes[1].rc_rate, 8);
  EXPECT_EQ(read->axes[2].rc_rate, 9);
  EXPECT_EQ(read->axes[0].super_rate, 67);
  EXPECT_EQ(read->axes[1].super_rate, 68);
  EXPECT_EQ(read->axes[2].super_rate, 69);
  EXPECT_EQ(read->axes[0].expo, 30);
  EXPECT_EQ(read->axes[1].expo, 11);
  EXPECT_EQ(read->axes[2].expo, 12);
  EXPECT_EQ(read->axes[1].limit_deg_s, 1500);
  EXPECT_EQ(read->axes[2].limit_deg_s, 1000);
  EXPECT_EQ(read->type, RcTuning::RatesType::kActual);
  EXPECT_EQ(read->throttle_limit, RcTuning::ThrottleLimit::kScale);
  EXPECT_EQ(read->throttle_limit_percent, 80);
  EXPECT_EQ(read->throttle_mid, 40);
  EXPECT_EQ(read->throttle_expo, 20);
}

/// A number of a message: where it lies and what it may be. All bytes that a message needs belong to one, so that one
/// that is added to a message has to be added here.
struct Number {
  const char* name;
  std::size_t bytes;
  bool with_sign;
  int low, high;  ///< what is taken; what its type can't say beyond that is not tried
};
constexpr int kAny8 = 255, kAny16 = 65535;

Number u8(const char* name, int low = 0, int high = kAny8) { return {name, 1, false, low, high}; }
Number u16(const char* name, int low = 0, int high = kAny16) { return {name, 2, false, low, high}; }
Number i16(const char* name, int low = -32768, int high = 32767) { return {name, 2, true, low, high}; }

std::map<std::string, std::vector<Number>> numbers() {
  std::vector<Number> tuning{u8("rc_rate roll"),         u8("expo roll", 0, 100),     u8("super rate roll"),
                             u8("super rate pitch"),     u8("super rate yaw"),        u8("0"),
                             u8("throttle mid", 0, 100), u8("throttle expo", 0, 100), u16("0"),
                             u8("expo yaw", 0, 100),     u8("rc_rate yaw"),           u8("rc_rate pitch"),
                             u8("expo pitch", 0, 100),   u8("limit type", 0, 2),      u8("limit percent", 1, 100)};
  for (const char* axis : {"limit roll", "limit pitch", "limit yaw"}) tuning.push_back(u16(axis, 1, 1998));
  tuning.push_back(u8("type", 0, 4));
  const auto repeated = [](const Number& number, std::size_t count) { return std::vector<Number>(count, number); };
  return {
      {"api", {u8("protocol"), u8("major"), u8("minor")}},
      {"variant", repeated(u8("letter", '!', '~'), 4)},
      {"version", repeated(u8("part"), 3)},
      {"status",
       {u16("cycle time"),
        u16("bus errors"),
        u16("sensors"),
        u16("modes"),
        u16("modes"),
        u8("profile"),
        u16("load"),
        u16("two bytes"),
        {"more modes, whose count moves the rest", 1, false, 2, 2},
        u8("more"),
        u8("more"),
        u8("reasons", 1, 32),
        u16("disabled"),
        u16("disabled")}},
      {"attitude", {i16("roll", -1800, 1800), i16("pitch", -900, 900), i16("yaw", 0, 360)}},
      {"imu", repeated(i16("axis"), 6)},
      {"battery",
       {u8("cells"), u16("capacity"), u8("tenths"), u16("drawn"), i16("current"), u8("state", 0, 4), u16("voltage")}},
      {"rc", repeated(u16("pulse"), 4)},
      {"motors", repeated(u16("pulse", 0, 2100), 8)},
      {"tuning", tuning},
      // Their order against each other is another test's: alone, each may go as far as the others let it.
      {"rx",
       {u8("provider"), u16("max_check", 1051, 2250), u16("mid_rc", 1200, 1700), u16("min_check", 750, 1899),
        u8("bind"), u16("shortest", 750, 2114), u16("longest", 886, 2250)}},
      {"map",
       {u8("roll", 0, 0), u8("pitch", 1, 1), u8("yaw", 3, 3), u8("throttle", 2, 2), u8("AUX1", 4, 4), u8("AUX2", 5, 5),
        u8("AUX3", 6, 6), u8("AUX4", 7, 7)}},
      {"deadband", {u8("roll and pitch", 0, 100), u8("yaw", 0, 100)}},
      {"failsafe",
       {u8("delay"), u8("landing"), u16("throttle"), u8("switch mode"), u16("recovery"), u8("procedure", 0, 2)}},
      {"features", {u16("low"), u16("high")}},
      {"mixer", {u8("kind"), u8("reversed")}},
  };
}

/// What is just within and just beyond both ends of a number, as far as its bytes can say it.
struct Ends {
  std::vector<int> within, beyond;
};
Ends ends_of(const Number& number) {
  const int lowest = number.with_sign ? -(1 << (8 * number.bytes - 1)) : 0;
  const int highest = number.with_sign ? (1 << (8 * number.bytes - 1)) - 1 : (1 << (8 * number.bytes)) - 1;
  Ends ends{{number.low, number.high}, {}};
  for (const int value : {number.low - 1, lowest})
    if (value >= lowest && value < number.low) ends.beyond.push_back(value);
  for (const int value : {number.high + 1, highest})
    if (value <= highest && value > number.high) ends.beyond.push_back(value);
  return ends;
}

TEST(MspMessages, EveryNumberOutOfItsRangeGivesNothing) {
  const auto all = numbers();
  int refused = 0;
  for (const Message& message : messages()) {
    ASSERT_TRUE(all.contains(message.name)) << message.name << " has no table of its numbers";
    std::size_t place = 0;
    for (const Number& number : all.at(message.name)) {
      const auto read_with = [&](int value) {
        auto bytes = message.right;
        for (std::size_t i = 0; i < number.bytes; ++i)
          bytes.at(place + i) = static_cast<std::uint8_t>(static_cast<unsigned>(value) >> (8 * i));
        return message.read(bytes);
      };
      const Ends ends = ends_of(number);
      for (const int value : ends.within)
        EXPECT_TRUE(read_with(value)) << message.name << ": " << number.name << " of " << value;
      for (const int value : ends.beyond)
        EXPECT_FALSE(read_with(value)) << message.name << ": " << number.name << " of " << value;
      refused += static_cast<int>(ends.beyond.size());
      place += number.bytes;
    }
    EXPECT_EQ(place, message.needed) << message.name << ": every byte belongs to a number";
  }
  EXPECT_GT(refused, 50);
}

TEST(MspMessages, SettingsThatContradictEachOtherGiveNothing) {
  EXPECT_FALSE(read_rx_config(rx_config(2200, 1500, 2100, 885, 2115)).has_value());
  EXPECT_FALSE(read_rx_config(rx_config(1900, 1500, 1050, 2115, 885)).has_value());
  EXPECT_FALSE(read_rx_map(std::vector<std::uint8_t>{0, 1, 3, 3, 4, 5, 6, 7}).has_value()) << "one place twice";
}

TEST(MspMessages, FailsafeAndMixerHaveUnits) {
  const auto failsafe = read_failsafe(Written().u8(15).u8(10).u16(1100).u8(0).u16(100).u8(1));
  ASSERT_TRUE(failsafe.has_value());
  EXPECT_DOUBLE_EQ(failsafe->delay_s, 1.5);
  EXPECT_EQ(failsafe->throttle, 1100);
  EXPECT_EQ(failsafe->procedure, Failsafe::Procedure::kDrop);
  const auto mixer = read_mixer(std::vector<std::uint8_t>{3, 1});
  ASSERT_TRUE(mixer.has_value());
  EXPECT_EQ(mixer->kind, 3);
  EXPECT_TRUE(mixer->yaw_reversed);
}

TEST(MspMessages, ModeRangesThatAreNotInUseAreLeftOut) {
  const auto read = read_mode_ranges(std::vector<std::uint8_t>{kModeArm, 0, 32, 48, 0, 0, 0, 0, kModeAngle, 2, 48, 32});
  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read->count, 1u);
  EXPECT_EQ(read->ranges[0].mode, kModeArm);
  EXPECT_EQ(read->ranges[0].aux, 0);
  EXPECT_EQ(read->ranges[0].begin_us, 1700);
  EXPECT_EQ(read->ranges[0].end_us, 2100);
  EXPECT_FALSE(read_mode_ranges(std::vector<std::uint8_t>{0, 0, 32}).has_value());
}

TEST(MspMessages, GyroIsInRadiansASecond) {
  const auto read = read_raw_imu(Written().u16(1).u16(2).u16(2048).u16(1476).u16(-2952).u16(164).u16(0).u16(0).u16(0));
  ASSERT_TRUE(read.has_value());
  EXPECT_NEAR(read->gyro_rad_s[0], std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(read->gyro_rad_s[1], -std::numbers::pi, 1e-12);
  EXPECT_EQ(read->acceleration[2], 2048);
}

TEST(MspMessages, CommandsAreWrittenLittleEndian) {
  std::array<std::uint16_t, kMaxChannels> channels{};
  channels[0] = 0x05DC;
  channels[17] = 0x0102;
  const auto bytes = raw_rc(channels);
  EXPECT_EQ(bytes.size(), 36u);
  EXPECT_EQ(bytes[0], 0xDC);
  EXPECT_EQ(bytes[1], 0x05);
  EXPECT_EQ(bytes[34], 0x02);
  EXPECT_EQ(bytes[35], 0x01);
  const auto motors = set_motor({1000, 1100, 1200, 1300, 0, 0, 0, 0});
  EXPECT_EQ(read_motors(motors), (Motors{1000, 1100, 1200, 1300, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace gatefield::firmware::msp
