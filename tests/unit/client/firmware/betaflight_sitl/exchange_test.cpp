#include "client/firmware/betaflight_sitl/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace gatefield::firmware::betaflight_sitl {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class BetaflightSitlExchange : public testing::Test {
 protected:
  void SetUp() override {
    clock.set(10s);
    states = opened("udp-listen:127.0.0.1:0");
    options.state_port = states->local_port();
    options.motors_port = opened("udp-listen:127.0.0.1:0")->local_port();
    channels = opened("udp-listen:127.0.0.1:0");
    options.channels_port = channels->local_port();
    auto made = Exchange::open(options, clock);
    ASSERT_TRUE(made.ok()) << made.error();
    exchange = std::move(made).value();
    motors = opened("udp:127.0.0.1:" + std::to_string(options.motors_port));
  }
  static std::unique_ptr<Link> opened(const std::string& written) {
    auto link = firmware::open(*parse_address(written), 1s);
    EXPECT_TRUE(link.ok()) << link.error();
    return std::move(link).value();
  }
  std::optional<Motors> after_packet(std::span<const std::uint8_t> packet) {
    EXPECT_EQ(motors->send(packet).bytes, packet.size());
    EXPECT_TRUE(exchange->wait(2s));
    return exchange->exchange({});
  }

  ManualClock clock;
  ExchangeOptions options;
  /// The newest state that came.
  double stamp_of_state() {
    double stamp_s = 0.0;
    std::array<std::uint8_t, 256> packet{};
    EXPECT_TRUE(states->wait(2s));
    while (states->receive(packet).bytes > 0) stamp_s = read_stamp_s(packet);
    return stamp_s;
  }

  std::unique_ptr<Link> states, motors, channels;
  std::unique_ptr<Exchange> exchange;
};

TEST_F(BetaflightSitlExchange, AStateGoesOutAndTheNewestMotorsComeIn) {
  EXPECT_FALSE(exchange->exchange({}).has_value()) << "none yet";
  ASSERT_TRUE(states->wait(2s));
  std::array<std::uint8_t, 256> packet{};
  EXPECT_EQ(states->receive(packet).bytes, kStateBytes);

  (void)motors->send(encode(Motors{0.1, 0.1, 0.1, 0.1}, options.wire));
  const Motors newest{0.125, 0.25, 0.5, 1.0};
  EXPECT_EQ(after_packet(encode(newest, options.wire)), newest);
  EXPECT_EQ(exchange->received(), 2u);
  EXPECT_EQ(exchange->exchange({}), newest) << "they hold until others come";
}

TEST_F(BetaflightSitlExchange, SilenceIsTimedAndSaidWithWhatToLookAt) {
  clock.advance(700ms);
  EXPECT_EQ(exchange->silent_for(), 700ms);
  EXPECT_THAT(exchange->silence().message, HasSubstr("no motors came from the firmware for 0.7 s"));
  ASSERT_TRUE(after_packet(encode(Motors{}, options.wire)).has_value());
  EXPECT_EQ(exchange->silent_for(), 0ns);
  clock.advance(2s);
  EXPECT_EQ(exchange->silent_for(), 2s);
  EXPECT_EQ(exchange->silence().code, ErrorCode::kNotAnswering);
  EXPECT_EQ(exchange->silence().field, "flight_controller");
  EXPECT_THAT(exchange->silence().message, HasSubstr("chrt"));
}

TEST_F(BetaflightSitlExchange, WhatIsNoSetOfMotorsIsCountedAndBreaksNoSilence) {
  clock.advance(1s);
  EXPECT_FALSE(after_packet(std::array<std::uint8_t, 3>{1, 2, 3}).has_value());
  EXPECT_EQ(exchange->malformed(), 1u);
  EXPECT_EQ(exchange->silent_for(), 1s);
}

TEST_F(BetaflightSitlExchange, AStepEndsWithTheMotorsOfItsOwnStamp) {
  EXPECT_FALSE(exchange->end_step(1s).has_value()) << "none has begun";
  exchange->begin_step({}, 1ms);
  const double first_s = stamp_of_state();
  (void)motors->send(encode(StampedMotors{{0.25, 0.25, 0.25, 0.25}, first_s}, options.wire));
  EXPECT_EQ(exchange->end_step(1s), (Motors{0.25, 0.25, 0.25, 0.25}));

  exchange->begin_step({}, 3ms);
  const double second_s = stamp_of_state();
  EXPECT_NEAR(second_s - first_s, 0.003, 1e-12);
  (void)motors->send(encode(StampedMotors{{0.5, 0.5, 0.5, 0.5}, first_s}, options.wire));  // too late for the first
  (void)motors->send(encode(StampedMotors{{0.75, 0.75, 0.75, 0.75}, second_s}, options.wire));
  EXPECT_EQ(exchange->end_step(1s), (Motors{0.75, 0.75, 0.75, 0.75}));

  exchange.reset();
  EXPECT_EQ(stamp_of_state(), second_s) << "the same again gives it its clock back";
}

TEST_F(BetaflightSitlExchange, MotorsWithoutAStampInLockstepSayWhatIsMissing) {
  const MonotonicClock real{};  // it waits
  auto other = options;
  other.motors_port = opened("udp-listen:127.0.0.1:0")->local_port();
  auto patient = Exchange::open(other, real).value();
  patient->begin_step({}, 1ms);
  (void)opened("udp:127.0.0.1:" + std::to_string(other.motors_port))->send(encode(Motors{}, options.wire));
  EXPECT_FALSE(patient->end_step(100ms).has_value());
  EXPECT_THAT(patient->silence().message, HasSubstr("LD_PRELOAD=libgatefield-betaflight-clock.so"));
}

TEST_F(BetaflightSitlExchange, ChannelsGoToTheirPort) {
  Channels sent{};
  sent.fill(1500);
  ASSERT_TRUE(exchange->send(sent));
  ASSERT_TRUE(channels->wait(2s));
  std::array<std::uint8_t, 256> packet{};
  EXPECT_EQ(read_channels(std::span(packet).first(channels->receive(packet).bytes)), sent);
}

TEST_F(BetaflightSitlExchange, ASecondSimulatorIsToldThatThePortIsTaken) {
  const auto second = Exchange::open(options, clock);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.failure().field, "port");
  EXPECT_THAT(second.error(), HasSubstr("in use"));
}

}  // namespace
}  // namespace gatefield::firmware::betaflight_sitl
