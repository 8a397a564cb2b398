#include "client/bridge/betaflight/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/betaflight_controller.h"
#include "tests/support/link_pair.h"

namespace gatefield::bridge::betaflight {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

using Bytes = std::vector<std::uint8_t>;

class BetaflightSettings : public testing::Test {
 protected:
  BetaflightSettings() {
    clock.set(10s);
    cable->on_wait = [this](std::chrono::nanoseconds timeout) {
      clock.advance(std::min<std::chrono::nanoseconds>(timeout, 1ms));
      board.serve(clock.now());
    };
  }

  Result<Settings> read() { return read_settings(connection, 500ms); }
  Status checked() {
    auto settings = read();
    EXPECT_TRUE(settings.ok()) << settings.error();
    return check(*settings, options, rates);
  }
  Bytes& answer(std::uint16_t command) { return board.answers[command]; }
  void add_mode(std::size_t place, std::uint8_t mode, int aux, int from_us, int to_us) {
    const Bytes range{mode, static_cast<std::uint8_t>(aux - 1), static_cast<std::uint8_t>((from_us - 900) / 25),
                      static_cast<std::uint8_t>((to_us - 900) / 25)};
    std::copy(range.begin(), range.end(),
              answer(msp::command::kModeRanges).begin() + static_cast<std::ptrdiff_t>(4 * place));
  }

  ManualClock clock;
  std::shared_ptr<test::Cable> cable = std::make_shared<test::Cable>();
  test::BetaflightController board{std::make_unique<test::CableEnd>(cable, false)};
  msp::Connection connection{std::make_unique<test::CableEnd>(cable, true), clock};
  Options options;
  std::array<double, 3> rates{9, 9, 6};
};

TEST_F(BetaflightSettings, AreReadAndAllRight) {
  const auto settings = read();
  ASSERT_TRUE(settings.ok()) << settings.error();
  EXPECT_EQ(settings->variant, "BTFL");
  EXPECT_EQ(settings->version, (msp::FirmwareVersion{4, 5, 1}));
  EXPECT_EQ(settings->ranges.count, 1u);
  EXPECT_EQ(settings->boxes.size(), 4u);
  EXPECT_TRUE(check(*settings, options, rates).ok());
}

TEST_F(BetaflightSettings, AnotherFirmwareIsRefusedByName) {
  answer(msp::command::kFcVariant) = {'I', 'N', 'A', 'V'};
  const auto settings = read();
  ASSERT_FALSE(settings.ok());
  EXPECT_EQ(settings.failure().code, ErrorCode::kUnsupported);
  EXPECT_EQ(settings.failure().field, "firmware");
  EXPECT_THAT(settings.error(), HasSubstr("'INAV'"));
}

TEST_F(BetaflightSettings, KnownVersionsAreTakenAndOthersRefused) {
  for (const Bytes& version : {Bytes{4, 4, 0}, Bytes{4, 5, 3}, Bytes{25, 12, 1}, Bytes{26, 6, 0}}) {
    answer(msp::command::kFcVersion) = version;
    EXPECT_TRUE(read().ok());
  }
  for (const Bytes& version : {Bytes{4, 3, 9}, Bytes{3, 5, 7}, Bytes{5, 0, 0}, Bytes{27, 1, 0}}) {
    answer(msp::command::kFcVersion) = version;
    const auto settings = read();
    ASSERT_FALSE(settings.ok());
    EXPECT_EQ(settings.failure().field, "firmware");
    EXPECT_EQ(settings.failure().code, ErrorCode::kUnsupported);
    EXPECT_THAT(settings.error(), HasSubstr("4.4 to 2026.12"));
  }
}

TEST_F(BetaflightSettings, AnAnswerThatIsCutOrImpossibleIsTold) {
  for (const std::uint16_t command : {msp::command::kFcVersion, msp::command::kRcTuning, msp::command::kRxConfig,
                                      msp::command::kRxMap, msp::command::kRcDeadband, msp::command::kFailsafeConfig,
                                      msp::command::kMixerConfig, msp::command::kFeatureConfig}) {
    const Bytes right = answer(command);
    answer(command) = {right.front()};
    const auto settings = read();
    ASSERT_FALSE(settings.ok()) << command;
    EXPECT_EQ(settings.failure().code, ErrorCode::kInvalid) << command;
    EXPECT_EQ(settings.failure().field, "link") << command;
    EXPECT_THAT(settings.error(), HasSubstr("MSP command " + std::to_string(command)));
    answer(command) = right;
  }
}

TEST_F(BetaflightSettings, ABoardThatDoesNotKnowACommandIsTold) {
  board.answers.erase(msp::command::kRxMap);
  const auto settings = read();
  ASSERT_FALSE(settings.ok());
  EXPECT_EQ(settings.failure().code, ErrorCode::kUnsupported);
}

TEST_F(BetaflightSettings, ABoardThatFallsSilentEndsTheReadingInTime) {
  board.silent = true;
  const Stamp begin = clock.now();
  const auto settings = read();
  ASSERT_FALSE(settings.ok());
  EXPECT_EQ(settings.failure().code, ErrorCode::kNoAnswer);
  EXPECT_LE(clock.now() - begin, 600ms) << "the first question, not all of them";
}

struct Refused {
  const char* field;
  const char* next_step;
};
void expect(const Status& status, const Refused& refused) {
  ASSERT_FALSE(status.ok()) << refused.field;
  EXPECT_EQ(status.failure().field, refused.field);
  EXPECT_THAT(status.error(), HasSubstr(refused.next_step));
}

TEST_F(BetaflightSettings, TheReceiverMustBeOurs) {
  answer(msp::command::kFeatureConfig) = {0, 0, 0, 0};
  expect(checked(), {"feature RX_MSP", "Receiver tab"});
}

TEST_F(BetaflightSettings, MotorsThatTurnBackwardsAreRefused) {
  answer(msp::command::kFeatureConfig) = {0, 0x50, 0, 0};
  expect(checked(), {"feature 3D", "switch it off"});
}

TEST_F(BetaflightSettings, TheArmSwitchMustBeWhereItIsLookedFor) {
  options.arm_aux = 2;
  expect(checked(), {"aux", "Modes tab"});
  options.arm_aux = 1;
  options.arm_us = 1500;
  expect(checked(), {"aux", "arm_us"});
  options.arm_us = 1900;
  add_mode(0, msp::kModeArm, 1, 900, 2100);
  expect(checked(), {"aux", "never disarm"});
}

TEST_F(BetaflightSettings, ModesThatFlyAnotherWayAreRefusedWhereTheyWouldBeOn) {
  add_mode(1, msp::kModeAngle, 3, 900, 1300);
  expect(checked(), {"aux", "sticks must mean rates"});
  EXPECT_THAT(checked().error(), HasSubstr("ANGLE on AUX3"));
  add_mode(1, msp::kModeAngle, 3, 1700, 2100);
  EXPECT_TRUE(checked().ok()) << "off at what is sent";
  add_mode(1, msp::kModeHorizon, 1, 1700, 2100);
  EXPECT_THAT(checked().error(), HasSubstr("HORIZON on AUX1 at 1900"));
  add_mode(1, msp::kModePrearm, 5, 1700, 2100);
  EXPECT_THAT(checked().error(), HasSubstr("PREARM"));
}

TEST_F(BetaflightSettings, OverrideNeedsItsSwitch) {
  options.receiver = Options::Receiver::kOverride;
  answer(msp::command::kFeatureConfig) = {8, 0, 0, 0};
  expect(checked(), {"aux", "msp_override_channels_mask"});
  add_mode(1, msp::kModeMspOverride, 4, 1700, 2100);
  EXPECT_TRUE(checked().ok());
}

TEST_F(BetaflightSettings, ChannelsOverUdpNeedNoReceiverUntil2025AndItsOwnSince) {
  options.receiver = Options::Receiver::kUdp;
  answer(msp::command::kFeatureConfig) = {8, 0, 0, 0};
  answer(msp::command::kFcVersion) = {4, 5, 6};
  EXPECT_TRUE(checked().ok()) << checked().error();
  answer(msp::command::kFcVersion) = {4, 4, 3};
  expect(checked(), {"feature RX_MSP", "on"});
  answer(msp::command::kFcVersion) = {26, 6, 0};
  expect(checked(), {"feature RX_UDP", "command line"});
  answer(msp::command::kFeatureConfig) = {2, 0, 0, 0};
  EXPECT_TRUE(checked().ok()) << checked().error();
}

TEST_F(BetaflightSettings, AMixerOtherThanOurFourRotorsIsRefused) {
  answer(msp::command::kMixerConfig) = {1, 0};
  expect(checked(), {"mixer", "QUADX"});
}

TEST_F(BetaflightSettings, TheMiddleMustBeTheMiddle) {
  answer(msp::command::kRxConfig)[3] = 0xD0;  // 1488
  expect(checked(), {"mid_rc", "Receiver tab"});
}

TEST_F(BetaflightSettings, RatesMustReachWhatThePlannerMayAskFor) {
  rates = {9, 12, 6};  // the end of the stick is 11.69 rad/s
  expect(checked(), {"pitch_srate", "Rates tab"});
  EXPECT_THAT(checked().error(), HasSubstr("670 deg/s"));
  EXPECT_THAT(checked().error(), HasSubstr("at least 688 deg/s"));
  rates = {0, 0, 0};
  answer(msp::command::kRcTuning)[4] = 0;   // yaw: no super rate
  answer(msp::command::kRcTuning)[11] = 0;  // and no rate
  expect(checked(), {"yaw_srate", "0 deg/s"});
}

TEST_F(BetaflightSettings, TheFirmwaresOwnFailsafeIsJudged) {
  std::string why;
  EXPECT_EQ(judge_failsafe(*read(), options, &why), flight::FirmwareFailsafe::kGood);
  EXPECT_EQ(why, "");

  Bytes& failsafe = answer(msp::command::kFailsafeConfig);
  failsafe[0] = 50;
  EXPECT_EQ(judge_failsafe(*read(), options, &why), flight::FirmwareFailsafe::kBad);
  EXPECT_THAT(why, HasSubstr("failsafe_delay is 5.0 s"));
  failsafe[0] = 5;
  failsafe.back() = 2;
  EXPECT_EQ(judge_failsafe(*read(), options, &why), flight::FirmwareFailsafe::kBad);
  EXPECT_THAT(why, HasSubstr("GPS-RESCUE"));

  options.receiver = Options::Receiver::kOverride;
  EXPECT_EQ(judge_failsafe(*read(), options, &why), flight::FirmwareFailsafe::kNotChecked);
  EXPECT_THAT(why, HasSubstr("keeps the last channels"));
}

}  // namespace
}  // namespace gatefield::bridge::betaflight
