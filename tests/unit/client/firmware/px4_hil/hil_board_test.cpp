#include "client/firmware/px4_hil/hil_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client/firmware/mavlink/constants.h"
#include "client/firmware/px4_hil/sensors.h"
#include "tests/support/borrowed_clock.h"
#include "tests/support/link_pair.h"

namespace gatefield::firmware {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

HilOptions options() {
  HilOptions options;
  options.address = "serial:/dev/ttyACM0:921600";
  options.connect_timeout = 5s;
  return options;
}

/// The other side of the cable, by the test's hand: a heartbeat every 0.5 s and motors every 5 ms, as told.
class HilBoardTest : public testing::Test {
 protected:
  HilBoardTest() {
    clock_.set(100s);
    cable_->on_wait = [this](std::chrono::nanoseconds timeout) { pass(timeout); };
  }

  /// Time goes by, and the board does what is due.
  void pass(Stamp span) {
    for (const Stamp end = clock_.now() + span; clock_.now() < end;) {
      clock_.advance(std::min<Stamp>(5ms, end - clock_.now()));
      since_boot_ += 5ms;
      if (!speaks_) continue;
      if (clock_.now() >= next_heartbeat_) {
        next_heartbeat_ = clock_.now() + 500ms;
        say(heartbeat());
      }
      if (armed_ && motors_run_) say(motors());
    }
  }
  void say(const mavlink::Message& message) { end_.send(mavlink::pack(message, from_, sequence_++).bytes()); }
  mavlink::Heartbeat heartbeat() const {
    mavlink::Heartbeat message;
    message.autopilot = static_cast<std::uint8_t>(mavlink::AutopilotKind::kPx4);
    message.type = static_cast<std::uint8_t>(mavlink::VehicleType::kQuadrotor);
    message.base_mode = static_cast<std::uint8_t>((hil_ ? mavlink::kModeHil : 0) | (armed_ ? mavlink::kModeArmed : 0));
    return message;
  }
  mavlink::HilActuatorControls motors() const {
    mavlink::HilActuatorControls message;
    message.time_usec = static_cast<std::uint64_t>(since_boot_ / 1us);
    message.flags = flags_;
    message.controls = {0.1F, 0.2F, 0.3F, outputs_};
    message.mode = static_cast<std::uint8_t>(mavlink::kModeHil | (armed_ ? mavlink::kModeArmed : 0));
    return message;
  }

  void fly() {
    ASSERT_TRUE(board_.connect().ok());
    armed_ = true;
    next_heartbeat_ = clock_.now();
    pass(100ms);
    const auto motors = board_.hear();
    ASSERT_TRUE(motors.ok()) << motors.error();
    ASSERT_TRUE(motors->armed);
  }
  /// The first failure within `span`, looked for every 5 ms.
  Error failure_within(Stamp span) {
    for (const Stamp end = clock_.now() + span; clock_.now() < end;) {
      pass(5ms);
      if (const auto heard = board_.hear(); !heard) return heard.failure();
    }
    return Error("none", ErrorCode::kOther);
  }

  ManualClock clock_;
  std::shared_ptr<test::Cable> cable_ = std::make_shared<test::Cable>();
  test::CableEnd end_{cable_, false};
  HilBoard board_{options(), std::make_unique<test::CableEnd>(cable_, true),
                  std::make_unique<test::BorrowedClock>(clock_)};
  Sensors sensors_{{}, {}};
  Stamp next_heartbeat_{0}, since_boot_{30s};
  mavlink::Address from_{1, 1};
  bool speaks_ = true, hil_ = true, armed_ = false, motors_run_ = true;
  std::uint64_t flags_ = 0xF;
  float outputs_ = 0.4F;
  std::uint8_t sequence_ = 0;
};

TEST_F(HilBoardTest, NewestMotorsCountAndNobodyWaits) {
  fly();
  const Stamp before = clock_.now();
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(board_.send(sensors_.sample(before, {}), sensors_.satellites(before, {})).ok());
    const auto motors = board_.hear();
    ASSERT_TRUE(motors.ok()) << motors.error();
    EXPECT_NEAR(motors->outputs[3], 0.4, 1e-6);
  }
  EXPECT_EQ(clock_.now(), before);
}

TEST_F(HilBoardTest, SamplesAndSatellitesGoOutAndNoTruth) {
  fly();
  cable_->to_board.clear();
  ASSERT_TRUE(board_.send(sensors_.sample(1s, {}), sensors_.satellites(1s, {})).ok());
  std::array<std::uint8_t, 2048> buffer{};
  const auto bytes = end_.receive(buffer).bytes;
  std::vector<std::uint32_t> ids;
  mavlink::FrameReader().read(std::span(buffer).first(bytes), true,
                              [&](const mavlink::Frame& frame) { ids.push_back(frame.id); });
  EXPECT_THAT(ids, testing::ElementsAre(mavlink::HilGps::kId, mavlink::HilSensor::kId));
}

TEST_F(HilBoardTest, APortThatSleepsIsWoken) {
  speaks_ = false;
  bool woken = false;
  cable_->on_wait = [&](std::chrono::nanoseconds timeout) {
    pass(timeout);
    woken = woken || !cable_->to_board.empty();
    speaks_ = woken;
  };
  EXPECT_TRUE(board_.connect().ok());
}

TEST_F(HilBoardTest, APortThatSaysNothingIsTold) {
  speaks_ = false;
  const Status status = board_.connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().code, ErrorCode::kNoAnswer);
  EXPECT_EQ(status.failure().field, "address");
  EXPECT_THAT(status.error(), AllOf(HasSubstr("nothing came from cable within 5 s"), HasSubstr("SYS_USB_AUTO")));
}

TEST_F(HilBoardTest, AnotherBaudRateIsTold) {
  cable_->noise = [](std::deque<std::uint8_t>* bytes) {
    for (auto& byte : *bytes) byte = static_cast<std::uint8_t>(byte * 37 + 11);
  };
  const Status status = board_.connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().code, ErrorCode::kNoAnswer);
  EXPECT_THAT(status.error(), AllOf(HasSubstr("no MAVLink frame"), HasSubstr("check the baud rate")));
}

TEST_F(HilBoardTest, APortOfSomethingElseIsTold) {
  speaks_ = false;
  cable_->on_wait = [this](std::chrono::nanoseconds timeout) {
    pass(timeout);
    auto message = heartbeat();
    message.autopilot = static_cast<std::uint8_t>(mavlink::AutopilotKind::kInvalid);
    say(message);
  };
  const Status status = board_.connect();
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error(), HasSubstr("no heartbeat of an autopilot was among them"));
}

TEST_F(HilBoardTest, OneThatIsNotInHilModeIsToldWithTheParameter) {
  hil_ = false;
  const Stamp begin = clock_.now();
  const Status status = board_.connect();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
  EXPECT_EQ(status.failure().field, "SYS_HITL");
  EXPECT_THAT(status.error(), AllOf(HasSubstr("is not in HIL mode"), HasSubstr("set SYS_HITL to 1")));
  EXPECT_GE(clock_.now() - begin, HilBoard::kModeGrace) << "it may still boot";
}

TEST_F(HilBoardTest, OneThatBootsIsWaitedFor) {
  hil_ = false;
  cable_->on_wait = [&, begin = clock_.now()](std::chrono::nanoseconds timeout) {
    pass(timeout);
    hil_ = clock_.now() - begin > 2s;
  };
  EXPECT_TRUE(board_.connect().ok());
}

TEST_F(HilBoardTest, OneThatLeavesHilModeInFlightIsTold) {
  fly();
  hil_ = false;
  const Error error = failure_within(5s);
  EXPECT_EQ(error.field, "SYS_HITL");
  EXPECT_THAT(error.message, HasSubstr("has left HIL mode"));
}

TEST_F(HilBoardTest, MotorsThatStopAreToldInTime) {
  fly();
  motors_run_ = false;
  const Stamp begin = clock_.now();
  const Error error = failure_within(5s);
  EXPECT_EQ(error.code, ErrorCode::kNotAnswering);
  EXPECT_THAT(error.message, HasSubstr("sent no motor outputs for 0.5 s; it hangs, lost power, or starts again"));
  EXPECT_LE(clock_.now() - begin, options().silence_limit + 20ms);
}

TEST_F(HilBoardTest, MotorsThatNeverComeAreToldWithTheRateOfThePort) {
  ASSERT_TRUE(board_.connect().ok());
  armed_ = true;
  motors_run_ = false;
  const Error error = failure_within(5s);
  EXPECT_EQ(error.code, ErrorCode::kNotAnswering);
  EXPECT_THAT(error.message, AllOf(HasSubstr("is armed and sent no motor outputs"), HasSubstr("MAV_0_RATE"),
                                   HasSubstr("pwm_out_sim")));
}

TEST_F(HilBoardTest, MotorsMayBeSilentWhileItIsNotArmed) {
  fly();
  armed_ = false;
  say(motors());
  EXPECT_EQ(failure_within(10s).message, "none");
}

TEST_F(HilBoardTest, OneThatFallsSilentBeforeItIsArmedIsTold) {
  ASSERT_TRUE(board_.connect().ok());
  speaks_ = false;
  const Error error = failure_within(10s);
  EXPECT_EQ(error.code, ErrorCode::kNotAnswering);
  EXPECT_THAT(error.message, HasSubstr("has been silent for 4.0 s"));
}

TEST_F(HilBoardTest, OneThatStartsAgainIsTold) {
  fly();
  since_boot_ = 2s;
  const Error error = failure_within(1s);
  EXPECT_EQ(error.code, ErrorCode::kNotAnswering);
  EXPECT_THAT(error.message, HasSubstr("started again; look at its power"));
}

TEST_F(HilBoardTest, OneThatStartsAgainBeforeItIsArmedIsToldByItsSystemTime) {
  ASSERT_TRUE(board_.connect().ok());
  say(mavlink::SystemTime{0, 60'000});
  ASSERT_TRUE(board_.hear().ok());
  say(mavlink::SystemTime{0, 59'500});
  ASSERT_TRUE(board_.hear().ok()) << "late, and no more";
  say(mavlink::SystemTime{0, 3'000});
  EXPECT_THAT(failure_within(10ms).message, HasSubstr("started again"));
}

TEST_F(HilBoardTest, APortThatIsGoneIsTold) {
  fly();
  cable_->broken = EIO;
  const auto heard = board_.hear();
  ASSERT_FALSE(heard.ok());
  EXPECT_EQ(heard.failure().code, ErrorCode::kNotAnswering);
  EXPECT_THAT(heard.error(), AllOf(HasSubstr("cable broke"), HasSubstr("look at cable and power")));
  EXPECT_FALSE(board_.send(sensors_.sample(1s, {}), std::nullopt).ok());
}

TEST_F(HilBoardTest, NoiseCostsWhatItSpoilsAndIsToldWithTheRest) {
  int count = 0;
  cable_->noise = [&](std::deque<std::uint8_t>* bytes) {
    if (++count % 3 == 0) bytes->at(bytes->size() / 2) ^= 0x10;
  };
  fly();
  EXPECT_EQ(failure_within(5s).message, "none");
  EXPECT_GT(board_.counts().bad_checksums, 100u);
  motors_run_ = false;
  EXPECT_THAT(failure_within(5s).message, HasSubstr("% of the bytes that came from it were noise"));
}

TEST_F(HilBoardTest, SamplesWithoutRoomAreDroppedAndToldWithTheRest) {
  fly();
  cable_->full = true;
  for (int i = 0; i < 7; ++i) ASSERT_TRUE(board_.send(sensors_.sample(1s, {}), std::nullopt).ok());
  motors_run_ = false;
  EXPECT_THAT(failure_within(1s).message, HasSubstr("7 samples found no room on the line"));
}

TEST_F(HilBoardTest, OutputsThatAreNoMotorsAreToldWithTheParameter) {
  fly();
  flags_ = 0x7;
  const Error error = failure_within(1s);
  EXPECT_EQ(error.code, ErrorCode::kInvalid);
  EXPECT_EQ(error.field, "HIL_ACT_FUNC");
  EXPECT_THAT(error.message, HasSubstr("HIL_ACT_FUNC1 to 4 to be 101 to 104"));
}

TEST_F(HilBoardTest, OlderReleasesSayNothingOfTheirOutputs) {
  flags_ = 0;
  fly();
  EXPECT_EQ(failure_within(1s).message, "none");
}

TEST_F(HilBoardTest, OutputsOutOfRangeAreRefused) {
  fly();
  outputs_ = -0.5F;
  EXPECT_EQ(failure_within(1s).field, "HIL_ACTUATOR_CONTROLS.controls[3]");
}

TEST_F(HilBoardTest, OthersOnThePortAreNotListenedTo) {
  fly();
  motors_run_ = false;
  auto strange = motors();
  strange.flags = 1;
  from_ = {1, 154};
  say(strange);
  from_ = {1, 1};
  EXPECT_TRUE(board_.hear().ok());
}

}  // namespace
}  // namespace gatefield::firmware
