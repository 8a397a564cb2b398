#include "client/firmware/msp/connection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/firmware/msp/messages.h"
#include "tests/support/allocation_trap.h"
#include "tests/support/betaflight_controller.h"
#include "tests/support/link_pair.h"

namespace gatefield::firmware::msp {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class MspConnection : public testing::Test {
 protected:
  MspConnection() {
    clock.set(10s);
    cable->on_wait = [this](std::chrono::nanoseconds timeout) {
      clock.advance(std::min<std::chrono::nanoseconds>(timeout, 1ms));
      if (board_works) board.serve(clock.now(), 1);
    };
  }

  ManualClock clock;
  std::shared_ptr<test::Cable> cable = std::make_shared<test::Cable>();
  test::BetaflightController board{std::make_unique<test::CableEnd>(cable, false)};
  bool board_works = true;
  Connection connection{std::make_unique<test::CableEnd>(cable, true), clock};
};

TEST_F(MspConnection, AskingGivesTheAnswer) {
  const auto answer = connection.ask(command::kFcVariant, 1s);
  ASSERT_TRUE(answer.ok()) << answer.error();
  EXPECT_THAT(*answer, ElementsAre('B', 'T', 'F', 'L'));
  EXPECT_EQ(connection.answers(), 1u);
  EXPECT_LE(*connection.round_trip(), 2ms);
}

TEST_F(MspConnection, NobodyAnsweringEndsInTimeAndSaysWhatToLookAt) {
  board_works = false;
  const Stamp begin = clock.now();
  const auto answer = connection.ask(command::kFcVariant, 1s);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.failure().code, ErrorCode::kNoAnswer);
  EXPECT_EQ(answer.failure().field, "link");
  EXPECT_THAT(answer.error(), HasSubstr("Ports tab"));
  EXPECT_LE(clock.now() - begin, 1100ms);
}

TEST_F(MspConnection, AnAnswerThatWasLostIsAskedForAgain) {
  int frames = 0;
  cable->noise = [&](std::deque<std::uint8_t>* bytes) {
    if (++frames < 3) bytes->pop_back();
  };
  EXPECT_TRUE(connection.ask(command::kFcVersion, 1s).ok());
  EXPECT_GE(frames, 3);
}

TEST_F(MspConnection, AnswersToEarlierQuestionsAreNotTakenForThisOne) {
  ASSERT_TRUE(connection.send(command::kFcVersion, {}));
  const auto answer = connection.ask(command::kFcVariant, 1s);
  ASSERT_TRUE(answer.ok());
  EXPECT_THAT(*answer, ElementsAre('B', 'T', 'F', 'L'));
}

TEST_F(MspConnection, ARefusalIsToldAtOnce) {
  const auto answer = connection.ask(9999, 1s);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.failure().code, ErrorCode::kUnsupported);
  EXPECT_LT(clock.now(), 10s + 100ms);
}

TEST_F(MspConnection, ABrokenLinkIsToldAtOnce) {
  cable->broken = EIO;
  const auto answer = connection.ask(command::kFcVariant, 1s);
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error(), HasSubstr("broke"));
  EXPECT_EQ(answer.failure().field, "link");
  EXPECT_TRUE(connection.failure().has_value());
  EXPECT_FALSE(connection.send(command::kStatus, {}));
}

TEST_F(MspConnection, NoMoreCommandsAreUnderWayThanAreAnswered) {
  EXPECT_TRUE(connection.send(command::kStatus, {}));
  EXPECT_TRUE(connection.send(command::kAttitude, {}));
  EXPECT_FALSE(connection.send(command::kStatus, {})) << "two wait";
  board.serve(clock.now(), 1);
  ASSERT_TRUE(connection.next().has_value());
  EXPECT_FALSE(connection.next().has_value());
  EXPECT_TRUE(connection.send(command::kStatus, {}));
  EXPECT_FALSE(connection.send(command::kStatus, {}));
}

TEST_F(MspConnection, WhatIsNotAnsweredIsGivenUpAfterAWhile) {
  cable->cut = true;
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  clock.advance(Connection::kLongest + 1ms);
  cable->cut = false;
  EXPECT_TRUE(connection.send(command::kStatus, {}));
  EXPECT_EQ(connection.lost(), 2u);
  EXPECT_EQ(connection.waiting(), 1u);
}

TEST_F(MspConnection, AQuickLinkIsNotWaitedForLong) {
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(connection.ask(command::kFcVariant, 1s).ok());
  cable->cut = true;
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  clock.advance(Connection::kShortest + 1ms);
  EXPECT_TRUE(connection.send(command::kStatus, {}));
}

TEST_F(MspConnection, AFrameWithAFalseLengthDoesNotHoldUpThoseBehindIt) {
  for (const char byte : std::string("$X>")) cable->to_us.push_back(static_cast<std::uint8_t>(byte));
  for (const std::uint8_t byte : std::array<std::uint8_t, 5>{0, 1, 0, 250, 0})
    cable->to_us.push_back(byte);  // 250 bytes that never come
  ASSERT_TRUE(connection.send(command::kFcVariant, {}));
  board.serve(clock.now());
  EXPECT_FALSE(connection.next().has_value());
  clock.advance(Connection::kLongest + 1ms);
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  const auto frame = connection.next();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->command, command::kFcVariant);
}

TEST_F(MspConnection, ALinkThatTakesNothingIsNoFailure) {
  cable->full = true;
  EXPECT_FALSE(connection.send(command::kStatus, {}));
  EXPECT_EQ(connection.waiting(), 0u);
  EXPECT_FALSE(connection.failure().has_value());
}

TEST_F(MspConnection, OurOwnEchoIsNoAnswer) {
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  cable->to_us = cable->to_board;
  EXPECT_FALSE(connection.next().has_value());
  EXPECT_EQ(connection.waiting(), 1u);
}

TEST_F(MspConnection, SendingAndHearingAllocatesNothing) {
  ASSERT_TRUE(connection.send(command::kStatus, {}));
  board.serve(clock.now());
  const std::array<std::uint8_t, 36> channels{};
  // the cable is made of queues that allocate; what is in the reader already is not
  ASSERT_TRUE(connection.next().has_value());
  cable->full = true;
  const test::AllocationTrap trap;
  (void)connection.send(command::kSetRawRc, channels);
  const bool heard = connection.next().has_value();
  EXPECT_EQ(trap.count(), 0u);
  EXPECT_FALSE(heard);
}

}  // namespace
}  // namespace gatefield::firmware::msp
