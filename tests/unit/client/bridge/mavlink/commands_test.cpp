#include "client/bridge/mavlink/commands.h"

#include <gtest/gtest.h>

#include <limits>

#include "client/bridge/mavlink/dialect.h"

namespace gatefield::bridge {
namespace {

using namespace std::chrono_literals;
using Kind = CommandFate::Kind;
using mavlink::Command;
using mavlink::CommandResult;

constexpr Stamp kBegin = 10s;

mavlink::CommandAck ack(Command command, CommandResult result) {
  mavlink::CommandAck message;
  message.command = static_cast<std::uint16_t>(command);
  message.result = static_cast<std::uint8_t>(result);
  return message;
}

/// How many were sent when it is wanted every 10 ms.
int sent_during(CommandDesk* desk, const mavlink::CommandLong& command, Stamp from, Stamp to) {
  int sent = 0;
  for (Stamp now = from; now < to; now += 10ms) sent += desk->want(now, command) ? 1 : 0;
  return sent;
}

TEST(CommandDesk, SendsOnceAndAgainUntilAnswered) {
  CommandDesk desk;
  const auto arm = arm_command(true, false);
  auto first = desk.want(kBegin, arm);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->confirmation, 0);
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kWaiting);
  EXPECT_FALSE(desk.want(kBegin + 499ms, arm));
  EXPECT_EQ(desk.want(kBegin + 500ms, arm)->confirmation, 1);
  EXPECT_EQ(desk.want(kBegin + 1s, arm)->confirmation, 2);
  desk.on_ack(kBegin + 1010ms, ack(Command::kArmDisarm, CommandResult::kAccepted));
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kAccepted);
  EXPECT_FALSE(desk.want(kBegin + 2s, arm)) << "it is given time to happen";
  EXPECT_EQ(desk.want(kBegin + 2010ms, arm)->confirmation, 0) << "and asked for again";
}

TEST(CommandDesk, TellsWhenNobodyAnswers) {
  CommandDesk desk;
  const auto arm = arm_command(true, false);
  EXPECT_EQ(sent_during(&desk, arm, kBegin, kBegin + 2500ms), CommandDesk::kTries);
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kWaiting);
  EXPECT_EQ(sent_during(&desk, arm, kBegin + 2500ms, kBegin + 3500ms), 0) << "a rest";
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kUnanswered);
  EXPECT_EQ(sent_during(&desk, arm, kBegin + 3500ms, kBegin + 6000ms), CommandDesk::kTries);
}

TEST(CommandDesk, KeepsWhatWasSaid) {
  CommandDesk desk;
  const auto mode = mode_command(Dialect::kPx4);
  for (const auto result : {CommandResult::kTemporarilyRejected, CommandResult::kDenied, CommandResult::kUnsupported,
                            CommandResult::kFailed, CommandResult::kCancelled, static_cast<CommandResult>(77)}) {
    desk.forget(Command::kDoSetMode);
    ASSERT_TRUE(desk.want(kBegin, mode));
    desk.on_ack(kBegin + 1ms, ack(Command::kDoSetMode, result));
    EXPECT_EQ(desk.fate(Command::kDoSetMode).kind, Kind::kRefused);
    EXPECT_EQ(desk.fate(Command::kDoSetMode).result, result);
  }
}

TEST(CommandDesk, WaitsLongerForWhatIsInProgress) {
  CommandDesk desk;
  const auto arm = arm_command(true, false);
  ASSERT_TRUE(desk.want(kBegin, arm));
  desk.on_ack(kBegin + 1ms, ack(Command::kArmDisarm, CommandResult::kInProgress));
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kInProgress);
  EXPECT_FALSE(desk.want(kBegin + 5s, arm));
  EXPECT_TRUE(desk.want(kBegin + 5001ms, arm));
}

TEST(CommandDesk, BeginsAnewWithOtherParameters) {
  CommandDesk desk;
  ASSERT_TRUE(desk.want(kBegin, arm_command(true, false)));
  EXPECT_TRUE(desk.want(kBegin + 1ms, arm_command(false, false))) << "disarming does not wait behind arming";
  EXPECT_TRUE(desk.want(kBegin + 2ms, arm_command(false, true)));
  auto unused = arm_command(false, true);
  unused.param7 = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(desk.want(kBegin + 3ms, unused));
  EXPECT_FALSE(desk.want(kBegin + 4ms, unused)) << "NaN is the same request";
}

TEST(CommandDesk, MindsNoAnswerThatWasNotAskedFor) {
  CommandDesk desk;
  desk.on_ack(kBegin, ack(Command::kArmDisarm, CommandResult::kDenied));
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kNeverAsked);
  ASSERT_TRUE(desk.want(kBegin, arm_command(true, false)));
  desk.on_ack(kBegin, ack(Command::kDoSetMode, CommandResult::kDenied));
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kWaiting);
  desk.forget(Command::kArmDisarm);
  desk.on_ack(kBegin, ack(Command::kArmDisarm, CommandResult::kDenied));
  EXPECT_EQ(desk.fate(Command::kArmDisarm).kind, Kind::kNeverAsked) << "an answer to what is no longer wanted";
}

}  // namespace
}  // namespace gatefield::bridge
