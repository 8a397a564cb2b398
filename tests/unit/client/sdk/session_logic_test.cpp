#include "client/sdk/session_logic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/support/messages.h"

namespace gatefield::sdk {
namespace {

using namespace std::chrono_literals;
using Phase = SessionLogic::Phase;
using Heard = SessionLogic::Heard;

protocol::SessionReply accept(std::uint64_t request, std::uint64_t session, const std::string& server = "planner-1") {
  auto reply = test::good_reply("drone", request);
  reply.session = session;
  reply.server = server;
  return reply;
}

protocol::SessionReply refuse(std::uint64_t request, const std::string& reason, const std::string& server = "planner-1",
                              ErrorCode code = ErrorCode::kInvalid) {
  auto reply = accept(request, 0, server);
  reply.accepted = false;
  reply.retry_after_s = 0;
  reply.code = code;
  reply.reason = reason;
  return reply;
}

protocol::SessionReply busy(std::uint64_t request, ErrorCode code = ErrorCode::kBusyName) {
  return refuse(request, "vehicle \"drone\" is flown by another client", "planner-1", code);
}

protocol::ThrustRateCommand command(std::uint64_t session, std::uint64_t sequence) {
  auto message = test::good_command("drone", sequence);
  message.session = session;
  return message;
}

/// A server's participant; its name tells it.
dds::ParticipantId participant_of(const std::string& server) {
  dds::ParticipantId id;
  std::copy_n(server.begin(), std::min(server.size(), id.bytes.size()), id.bytes.begin());
  return id;
}
bool hear(SessionLogic* logic, const protocol::SessionReply& reply, Stamp now) {
  return logic->on_reply(reply, participant_of(reply.server), now);
}

/// A command of our server.
Heard hear(SessionLogic* logic, const protocol::ThrustRateCommand& command, Stamp now = 0s) {
  return logic->on_command(command, logic->server(), now);
}

SessionLogic joined(std::uint64_t session = 50) {
  SessionLogic logic(7);
  logic.request_due(0s);
  EXPECT_TRUE(hear(&logic, accept(7, session), 0s));
  return logic;
}

TEST(SessionLogic, AsksAtOnceAndThenEveryHalfSecond) {
  SessionLogic logic(7);
  EXPECT_EQ(logic.request(), 7u);
  EXPECT_TRUE(logic.request_due(10s));
  EXPECT_FALSE(logic.request_due(10s + 499ms));
  EXPECT_TRUE(logic.request_due(10s + 500ms));
  EXPECT_FALSE(logic.request_due(10s + 501ms));
}

TEST(SessionLogic, JoinsWithTheFirstAcceptanceOfItsOwnRequest) {
  SessionLogic logic(7);
  EXPECT_FALSE(hear(&logic, accept(6, 49), 0s)) << "an answer to an earlier start";
  EXPECT_EQ(logic.phase(), Phase::kJoining);
  EXPECT_TRUE(hear(&logic, accept(7, 50), 0s));
  EXPECT_EQ(logic.phase(), Phase::kJoined);
  EXPECT_EQ(logic.session().session, 50u);
  EXPECT_EQ(logic.reconnects(), 0u);
  EXPECT_FALSE(logic.request_due(60s)) << "joined and not silent: nothing to ask";
}

TEST(SessionLogic, ARefusalIsFinal) {
  SessionLogic logic(7);
  EXPECT_FALSE(hear(&logic, refuse(7, "profile is \"x\", expected race or paper"), 0s));
  EXPECT_EQ(logic.phase(), Phase::kFailed);
  EXPECT_EQ(logic.refusal()->code, ErrorCode::kInvalid);
  EXPECT_EQ(logic.refusal()->message, "profile is \"x\", expected race or paper");
  EXPECT_FALSE(hear(&logic, accept(7, 50), 0s));
  EXPECT_FALSE(logic.request_due(60s));
}

TEST(SessionLogic, ARefusalSaysWhichFieldWasWrong) {
  SessionLogic logic(7);
  auto reply = refuse(7, "quadrotor.mass_kg is 0, expected more than 0 kg");
  reply.field = "quadrotor.mass_kg";
  reply.value = "0";
  reply.expected = "more than 0 kg";
  hear(&logic, reply, 0s);
  ASSERT_TRUE(logic.refusal().has_value());
  EXPECT_EQ(logic.refusal()->message, reply.reason);
  EXPECT_EQ(logic.refusal()->field, "quadrotor.mass_kg");
  EXPECT_EQ(logic.refusal()->value, "0");
  EXPECT_EQ(logic.refusal()->expected, "more than 0 kg");
}

TEST(SessionLogic, BusyIsTriedAgainWithANewNumberAfterAPause) {
  SessionLogic logic(7);
  EXPECT_TRUE(logic.request_due(1s));
  hear(&logic, busy(7), 1s);
  EXPECT_EQ(logic.phase(), Phase::kJoining);
  EXPECT_EQ(logic.request(), 8u);
  EXPECT_FALSE(logic.request_due(1s + 249ms));
  EXPECT_TRUE(logic.request_due(1s + 250ms));
  EXPECT_FALSE(hear(&logic, busy(7), 2s)) << "an answer to the attempt before";
  EXPECT_EQ(logic.request(), 8u);
  EXPECT_TRUE(hear(&logic, accept(8, 50), 2s));
}

TEST(SessionLogic, TheCodeDecidesWhetherARefusalMayPassAndNotTheSentence) {
  SessionLogic server_full(7);
  hear(&server_full, busy(7, ErrorCode::kBusyServer), 0s);
  EXPECT_EQ(server_full.phase(), Phase::kJoining);
  EXPECT_EQ(server_full.refusal()->code, ErrorCode::kBusyServer);
  SessionLogic refused(7);
  hear(&refused, refuse(7, "busy: not any more"), 0s);
  EXPECT_EQ(refused.phase(), Phase::kFailed);
}

protocol::SessionReply full(std::uint64_t request, double retry_after_s) {
  auto reply = busy(request, ErrorCode::kBusyServer);
  reply.retry_after_s = retry_after_s;
  return reply;
}

TEST(SessionLogic, ARefusalSaysWhenAskingAgainIsWorthWhile) {
  SessionLogic logic(7);
  EXPECT_TRUE(logic.request_due(1s));
  hear(&logic, full(7, 2.5), 1s);
  EXPECT_FALSE(logic.request_due(3s + 499ms));
  EXPECT_TRUE(logic.request_due(3s + 500ms));
  hear(&logic, full(8, 3600), 4s);
  EXPECT_FALSE(logic.request_due(63s));
  EXPECT_TRUE(logic.request_due(64s)) << "nobody is kept away for longer than a minute";
}

TEST(SessionLogic, WhoIsSentAwayComesBackWhenItIsWorthWhile) {
  SessionLogic logic = joined(50);
  logic.on_command(command(50, 1), logic.server(), 10s);
  logic.on_state_sent(10s);
  EXPECT_FALSE(hear(&logic, full(7, 5), 10s));
  EXPECT_EQ(logic.phase(), Phase::kEnded);
  logic.on_state_sent(14s);
  EXPECT_FALSE(logic.request_due(14s + 999ms));
  EXPECT_TRUE(logic.request_due(15s));
  EXPECT_TRUE(hear(&logic, accept(7, 60), 15s));
  EXPECT_EQ(logic.session().session, 60u);
}

/// A full server answers at once, the one that has room a moment later.
TEST(SessionLogic, AnAcceptanceThatComesAfterAnothersRefusalIsGood) {
  SessionLogic logic(7);
  EXPECT_TRUE(logic.request_due(1s));
  hear(&logic, full(7, 1), 1s);
  EXPECT_FALSE(hear(&logic, refuse(7, "no profile of that name", "planner-3"), 1s)) << "that attempt is over";
  EXPECT_EQ(logic.phase(), Phase::kJoining);
  EXPECT_TRUE(hear(&logic, accept(7, 70, "planner-2"), 1s + 100ms));
  EXPECT_EQ(logic.session().session, 70u);
  EXPECT_EQ(logic.request(), 7u) << "the session's number of request";

  SessionLogic late(7);
  EXPECT_TRUE(late.request_due(1s));
  hear(&late, full(7, 1), 1s);
  EXPECT_TRUE(late.request_due(2s));
  EXPECT_FALSE(hear(&late, accept(7, 70, "planner-2"), 2s)) << "the next attempt is out";
}

TEST(SessionLogic, TheRequestNumberNeverBecomesZero) {
  SessionLogic logic(UINT64_MAX);
  hear(&logic, busy(UINT64_MAX), 0s);
  EXPECT_EQ(logic.request(), 1u);
}

TEST(SessionLogic, CommandsOfTheSessionCountOnceAndOthersNever) {
  SessionLogic logic = joined(50);
  EXPECT_EQ(hear(&logic, command(50, 1)), Heard::kNew);
  EXPECT_EQ(hear(&logic, command(50, 1)), Heard::kRepeated);
  EXPECT_EQ(hear(&logic, command(50, 3)), Heard::kNew);
  EXPECT_EQ(hear(&logic, command(50, 2)), Heard::kRepeated);
  EXPECT_EQ(hear(&logic, command(51, 9)), Heard::kForeign);
  SessionLogic early(7);
  EXPECT_EQ(hear(&early, command(0, 1)), Heard::kForeign);
}

TEST(SessionLogic, AnotherSessionOfOurServerIsAdoptedAtOnce) {
  SessionLogic logic = joined(50);
  EXPECT_EQ(hear(&logic, command(50, 1000)), Heard::kNew);
  EXPECT_FALSE(hear(&logic, accept(7, 50), 1s)) << "the same reply again";
  EXPECT_TRUE(hear(&logic, accept(7, 60), 1s));
  EXPECT_EQ(logic.session().session, 60u);
  EXPECT_EQ(logic.reconnects(), 1u);
  EXPECT_EQ(hear(&logic, command(50, 1001)), Heard::kForeign);
  EXPECT_EQ(hear(&logic, command(60, 1)), Heard::kNew) << "a new session counts from 1";
}

TEST(SessionLogic, AnotherServersAcceptanceWaitsUntilOursIsSilent) {
  SessionLogic logic = joined(50);
  EXPECT_FALSE(hear(&logic, accept(7, 70, "planner-2"), 0s));
  EXPECT_EQ(logic.session().session, 50u);
  EXPECT_FALSE(logic.on_state_sent(1s));
  hear(&logic, command(50, 1));
  EXPECT_FALSE(logic.on_state_sent(5s)) << "a pause of our own is not the server's silence";
  EXPECT_FALSE(logic.on_state_sent(5s + 999ms));
  EXPECT_TRUE(logic.on_state_sent(6s));
  EXPECT_EQ(logic.session().session, 70u);
  EXPECT_EQ(logic.reconnects(), 1u);
  EXPECT_FALSE(logic.on_state_sent(6s + 500ms));
}

TEST(SessionLogic, ASilentServerIsAskedAgainOnceASecond) {
  SessionLogic logic = joined(50);
  logic.on_state_sent(10s);
  EXPECT_FALSE(logic.request_due(10s + 900ms));
  EXPECT_TRUE(logic.request_due(11s));
  EXPECT_FALSE(logic.request_due(11s + 900ms));
  EXPECT_TRUE(logic.request_due(12s));
  EXPECT_EQ(logic.request(), 7u) << "the same number: the server answers with the same session if it has it still";
}

TEST(SessionLogic, AServerThatEndsTheSessionIsFollowedByTheNextOne) {
  SessionLogic logic = joined(50);
  EXPECT_FALSE(hear(&logic, refuse(7, "stopping", "planner-2"), 0s)) << "not our server";
  EXPECT_EQ(logic.phase(), Phase::kJoined);
  EXPECT_FALSE(hear(&logic, refuse(7, "the server stops"), 0s));
  EXPECT_EQ(logic.phase(), Phase::kEnded);
  EXPECT_TRUE(hear(&logic, accept(7, 80, "planner-2"), 1s));
  EXPECT_EQ(logic.phase(), Phase::kJoined);
  EXPECT_EQ(logic.session().session, 80u);
}

TEST(SessionLogic, ASpareTakesOverAtOnceWhenTheSessionIsEnded) {
  SessionLogic logic = joined(50);
  hear(&logic, accept(7, 70, "planner-2"), 0s);
  EXPECT_TRUE(hear(&logic, refuse(7, "the server stops"), 0s));
  EXPECT_EQ(logic.session().server, "planner-2");
}

TEST(SessionLogic, AWithdrawnSpareIsForgotten) {
  SessionLogic logic = joined(50);
  hear(&logic, accept(7, 70, "planner-2"), 0s);
  hear(&logic, refuse(7, "the server stops", "planner-2"), 0s);
  logic.on_state_sent(1s);
  EXPECT_FALSE(logic.on_state_sent(3s));
  EXPECT_EQ(logic.session().session, 50u);
}

TEST(SessionLogic, AStrangersWordsChangeNothingWhileOursAnswers) {
  SessionLogic logic = joined(50);
  const dds::ParticipantId stranger = participant_of("stranger");
  EXPECT_FALSE(logic.on_reply(accept(7, 666), stranger, 0s)) << "with our server's name";
  EXPECT_FALSE(logic.on_reply(refuse(7, "go down", "planner-1", ErrorCode::kLeaving), stranger, 0s));
  EXPECT_FALSE(logic.on_reply(accept(7, 666), stranger, 0s));
  EXPECT_EQ(logic.phase(), Phase::kJoined);
  for (int i = 1; i < 500; ++i) {
    EXPECT_FALSE(logic.on_state_sent(i * 20ms));
    EXPECT_EQ(hear(&logic, command(50, static_cast<std::uint64_t>(i))), Heard::kNew);
  }
  EXPECT_EQ(logic.session().session, 50u);
  EXPECT_EQ(logic.server(), participant_of("planner-1"));
}

TEST(SessionLogic, ARestartedServerIsKnownByItsNameWhenOursIsSilent) {
  SessionLogic logic = joined(50);
  const dds::ParticipantId restarted = participant_of("a new start");
  EXPECT_FALSE(logic.on_reply(accept(7, 60), restarted, 0s));
  EXPECT_FALSE(logic.on_state_sent(1s));
  EXPECT_FALSE(logic.on_state_sent(1s + 499ms));
  EXPECT_TRUE(logic.on_state_sent(1s + 500ms));
  EXPECT_EQ(logic.session().session, 60u);
  EXPECT_EQ(logic.server(), restarted);
}

/// Its kind and its code; kRejoined and kNotAnswering: there is none.
std::pair<SessionChange::Kind, ErrorCode> next_change(SessionLogic* logic) {
  const auto change = logic->next_change();
  if (!change) return {SessionChange::Kind::kRejoined, ErrorCode::kNotAnswering};
  EXPECT_FALSE(change->sentence.empty());
  return {change->kind, change->why};
}
constexpr std::pair kNoChange{SessionChange::Kind::kRejoined, ErrorCode::kNotAnswering};
constexpr std::pair kJoinedAgain{SessionChange::Kind::kRejoined, ErrorCode::kOther};
constexpr auto lost(ErrorCode why) { return std::pair(SessionChange::Kind::kLost, why); }

TEST(SessionChanges, JoiningIsNone) {
  SessionLogic logic(7);
  hear(&logic, busy(7), 0s);
  hear(&logic, accept(8, 50), 1s);
  hear(&logic, command(50, 1), 1s);
  EXPECT_EQ(next_change(&logic), kNoChange);
}

TEST(SessionChanges, SayWhatTheServerEndedItWith) {
  SessionLogic logic = joined(50);
  hear(&logic,
       refuse(7, "session ended: a vehicle of higher priority needs its place", "planner-1", ErrorCode::kBusyServer),
       1s);
  const auto change = logic.next_change();
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->kind, SessionChange::Kind::kLost);
  EXPECT_EQ(change->why, ErrorCode::kBusyServer);
  EXPECT_EQ(change->server, "planner-1");
  EXPECT_NE(change->sentence.find("a vehicle of higher priority needs its place"), std::string::npos);
  EXPECT_EQ(next_change(&logic), kNoChange) << "each once";

  hear(&logic, busy(7, ErrorCode::kBusyServer), 2s);
  EXPECT_EQ(next_change(&logic), kNoChange) << "still full";
  hear(&logic, refuse(7, "no profile of that name", "planner-1", ErrorCode::kUnknownName), 3s);
  EXPECT_EQ(next_change(&logic), lost(ErrorCode::kUnknownName));
  hear(&logic, accept(7, 80, "planner-2"), 4s);
  EXPECT_EQ(next_change(&logic), kJoinedAgain);
  EXPECT_EQ(next_change(&logic), kNoChange);
}

TEST(SessionChanges, AStrangersWordIsNone) {
  SessionLogic logic = joined(50);
  logic.on_reply(refuse(7, "go down", "planner-1", ErrorCode::kLeaving), participant_of("stranger"), 0s);
  EXPECT_EQ(next_change(&logic), kNoChange);
}

TEST(SessionChanges, ASilentServerIsLostOnceAndFoundAgain) {
  SessionLogic logic = joined(50);
  hear(&logic, command(50, 1), 10s);
  logic.on_state_sent(10s + 10ms);
  logic.on_state_sent(11s + 499ms);
  EXPECT_EQ(next_change(&logic), kNoChange);
  logic.on_state_sent(11s + 500ms);
  logic.on_state_sent(13s);
  EXPECT_EQ(next_change(&logic), lost(ErrorCode::kNoAnswer));
  EXPECT_EQ(next_change(&logic), kNoChange);
  hear(&logic, command(50, 2), 14s);
  EXPECT_EQ(next_change(&logic), kJoinedAgain);
  EXPECT_EQ(logic.session().session, 50u);
}

/// It withholds its plans and says why.
TEST(SessionChanges, AServerThatSendsTelemetryIsNotSilent) {
  SessionLogic logic = joined(50);
  for (Stamp now = 10s; now < 20s; now += 20ms) {
    if (now % 500ms == 0ms) logic.on_telemetry(now);
    logic.on_state_sent(now);
  }
  EXPECT_EQ(next_change(&logic), kNoChange);
}

TEST(SessionChanges, AVehicleThatSaysNothingMissesNobody) {
  SessionLogic logic = joined(50);
  hear(&logic, command(50, 1), 10s);
  logic.on_state_sent(60s);
  EXPECT_EQ(next_change(&logic), kNoChange);
}

TEST(SessionChanges, ASpareComesAfterALossThatIsTold) {
  SessionLogic silent = joined(50);
  hear(&silent, accept(7, 70, "planner-2"), 0s);
  silent.on_state_sent(1s);
  EXPECT_TRUE(silent.on_state_sent(2s));
  EXPECT_EQ(next_change(&silent), lost(ErrorCode::kNoAnswer));
  EXPECT_EQ(next_change(&silent), kJoinedAgain);

  SessionLogic ended = joined(50);
  hear(&ended, accept(7, 70, "planner-2"), 0s);
  EXPECT_TRUE(hear(&ended, refuse(7, "the server stops", "planner-1", ErrorCode::kLeaving), 1s));
  EXPECT_EQ(next_change(&ended), lost(ErrorCode::kLeaving));
  const auto again = ended.next_change();
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->server, "planner-2");
}

TEST(SessionChanges, OfThoseThatNobodyAsksForTheOldestGo) {
  SessionLogic logic = joined(50);
  for (int i = 0; i < 40; ++i) {
    hear(&logic, refuse(7, "no", "planner-1", ErrorCode::kAbandoned), 1s);
    hear(&logic, accept(7, 60), 1s);
  }
  for (std::size_t i = 0; i < SessionLogic::kChangesKept; ++i) EXPECT_TRUE(logic.next_change().has_value());
  EXPECT_FALSE(logic.next_change().has_value());
}

/// Joined with planner-1, which names planner-2 as its heir; control period 20 ms, newest command at 10 s.
class Heir : public ::testing::Test {
 protected:
  void SetUp() override {
    logic_.request_due(0s);
    EXPECT_TRUE(hear(&logic_, reply("planner-1", "planner-2"), 0s));
    EXPECT_EQ(logic_.on_command(command(50, 400), kLeader, 10s), Heard::kNew);
  }
  static protocol::SessionReply reply(const std::string& server, const std::string& heir) {
    protocol::SessionReply reply = accept(7, 50, server);
    reply.control_period_s = 0.02;
    reply.heir = heir.empty() ? protocol::ParticipantBytes() : participant_of(heir).bytes;
    return reply;
  }
  const dds::ParticipantId kLeader = participant_of("planner-1"), kHeir = participant_of("planner-2");
  SessionLogic logic_{7};
};

TEST_F(Heir, IsNotHeardWhileTheLeaderCommands) {
  EXPECT_FALSE(logic_.ear().hears(kHeir, 10s + 39ms));
  EXPECT_EQ(logic_.on_command(command(50, 401), kHeir, 10s + 39ms), Heard::kForeign);
  EXPECT_EQ(logic_.server(), kLeader);
}

TEST_F(Heir, GoesOnWithTheSessionWhenTheLeaderIsSilent) {
  EXPECT_TRUE(logic_.ear().hears(kHeir, 10s + 40ms));
  EXPECT_EQ(logic_.on_command(command(50, 3), kHeir, 10s + 80ms), Heard::kNew) << "it counts by itself";
  EXPECT_EQ(logic_.server(), kHeir);
  EXPECT_EQ(logic_.phase(), Phase::kJoined);
  EXPECT_EQ(logic_.session().session, 50u);
  EXPECT_EQ(logic_.take_overs(), 1u);
  EXPECT_EQ(logic_.reconnects(), 0u);
}

TEST_F(Heir, EndsTheSilenceThatIsTold) {
  logic_.on_state_sent(10s + 10ms);
  logic_.on_command(command(50, 401), kLeader, 10s + 20ms);
  EXPECT_EQ(logic_.longest_silence(), 10ms);
  for (const Stamp now : {10s + 30ms, 10s + 60ms, 10s + 90ms}) logic_.on_state_sent(now);
  EXPECT_EQ(logic_.longest_silence(), 10ms) << "it is not over";
  logic_.on_command(command(50, 3), kHeir, 10s + 95ms);
  EXPECT_EQ(logic_.longest_silence(), 65ms) << "since the first state that nobody answered";
  logic_.on_state_sent(20s);
  logic_.on_command(command(50, 4), kHeir, 20s + 5ms);
  EXPECT_EQ(logic_.longest_silence(), 65ms) << "a vehicle that says nothing waits for nothing";
}

TEST_F(Heir, ThatTookOverIsTheServerAndTheLeaderIsHeardNoMore) {
  logic_.on_command(command(50, 401), kHeir, 10s + 80ms);
  for (const Stamp now : {Stamp(10s + 81ms), Stamp(11s), Stamp(60s)}) {
    EXPECT_FALSE(logic_.ear().hears(kLeader, now));
    EXPECT_EQ(logic_.on_command(command(50, 900), kLeader, now), Heard::kForeign);
  }
  EXPECT_FALSE(hear(&logic_, refuse(7, "the server stops"), 12s)) << "the old leader can't end it";
  EXPECT_EQ(logic_.phase(), Phase::kJoined);
  EXPECT_TRUE(logic_.on_reply(accept(7, 60), kHeir, 13s)) << "the heir can begin another session";
}

TEST_F(Heir, NamesTheNextHeirWheneverItSaysSo) {
  EXPECT_FALSE(hear(&logic_, reply("planner-2", "planner-3"), 10s + 70ms)) << "before its first command";
  EXPECT_EQ(logic_.session().server, "planner-1");
  logic_.on_command(command(50, 401), kHeir, 10s + 80ms);
  EXPECT_EQ(logic_.session().server, "planner-2");
  EXPECT_EQ(logic_.ear().heir, participant_of("planner-3"));
  EXPECT_FALSE(hear(&logic_, reply("planner-2", ""), 11s)) << "it is gone";
  EXPECT_EQ(logic_.ear().heir, dds::ParticipantId());
  EXPECT_FALSE(hear(&logic_, reply("planner-2", "planner-4"), 12s));
  EXPECT_EQ(logic_.on_command(command(50, 1), participant_of("planner-4"), 20s), Heard::kNew);
  EXPECT_EQ(logic_.take_overs(), 2u);
}

TEST_F(Heir, IsHeardAtOnceWhenTheLeaderHandedTheSessionOver) {
  protocol::SessionReply leaving = reply("planner-1", "planner-2");
  leaving.code = ErrorCode::kLeaving;
  EXPECT_FALSE(hear(&logic_, leaving, 10s + 1ms));
  EXPECT_EQ(logic_.on_command(command(50, 401), kLeader, 10s + 2ms), Heard::kNew) << "its last one is welcome";
  EXPECT_EQ(logic_.on_command(command(50, 402), kHeir, 10s + 3ms), Heard::kNew);
  EXPECT_EQ(logic_.server(), kHeir);
}

TEST_F(Heir, IsOnlyWhoTheLeaderNames) {
  const dds::ParticipantId stranger = participant_of("stranger");
  EXPECT_FALSE(logic_.on_reply(reply("planner-2", "stranger"), stranger, 10s));
  EXPECT_FALSE(logic_.ear().hears(stranger, 60s));
  EXPECT_EQ(logic_.on_command(command(50, 401), stranger, 60s), Heard::kForeign);
  EXPECT_EQ(logic_.on_command(command(51, 401), kHeir, 60s), Heard::kForeign) << "nor another session";
}

TEST_F(Heir, IsToldWithWhatBecameOfTheLeader) {
  EXPECT_FALSE(logic_.next_change().has_value());
  logic_.on_command(command(50, 3), kHeir, 10s + 80ms);
  auto change = logic_.next_change();
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->kind, SessionChange::Kind::kTakenOver);
  EXPECT_EQ(change->why, ErrorCode::kNoAnswer);
  EXPECT_FALSE(logic_.next_change().has_value());

  hear(&logic_, reply("planner-2", "planner-1"), 11s);
  protocol::SessionReply leaving = reply("planner-2", "planner-1");
  leaving.code = ErrorCode::kLeaving;
  logic_.on_reply(leaving, kHeir, 11s);
  hear(&logic_, reply("planner-1", ""), 11s);
  logic_.on_command(command(50, 4), kLeader, 11s + 3ms);
  change = logic_.next_change();
  ASSERT_TRUE(change.has_value());
  EXPECT_EQ(change->kind, SessionChange::Kind::kTakenOver);
  EXPECT_EQ(change->why, ErrorCode::kLeaving);
  EXPECT_EQ(change->server, "planner-1");
  EXPECT_EQ(change->sentence, "the session goes on with server planner-1: server planner-2 handed it over");
}

TEST_F(Heir, ThatNobodyNamedIsNobody) {
  SessionLogic logic = joined(50);
  EXPECT_FALSE(logic.ear().hears(dds::ParticipantId(), 60s));
}

}  // namespace
}  // namespace gatefield::sdk
