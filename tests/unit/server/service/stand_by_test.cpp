// A server and its stand-by, without their threads: what they tell each other, and who flies.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/service/service.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using testing::join_request;
using namespace std::chrono_literals;
using Kind = protocol::PilotRecord::Kind;

class TwoServers : public ::testing::Test {
 protected:
  TwoServers() {
    clock_.set(100s);
    leader_ = make("planner-1", &from_leader_, 0xabc);
    heir_ = make("planner-2", &from_heir_, 0xabc);
    from_leader_.told = [this](const auto& record) {
      if (connected_) heir_->on_record(record);
    };
    from_heir_.told = [this](const auto& record) {
      if (connected_) leader_->on_record(record);
    };
    leader_->on_heir(true);
    heir_->on_leader(true);
  }
  ~TwoServers() override { connected_ = false; }  // one goes before the other
  std::unique_ptr<Service> make(const std::string& name, testing::FakeTransport* transport, std::uint64_t model_hash) {
    ServiceOptions options;
    options.name = name;
    options.max_vehicles = 2;
    options.model_hash = model_hash;
    options.profiles = {{"race", testing::small_profile()}};
    options.has_heir = equals_ || name == "planner-1";
    options.stands_by = equals_ || !options.has_heir;
    return std::make_unique<Service>(options, testing::fake_factories(), &clock_, transport);
  }

  /// Both hear the request. @return what the leader says
  protocol::SessionReply join(const protocol::SessionRequest& request = join_request()) {
    heir_->on_request(request);
    leader_->on_request(request);
    heir_->housekeep();
    leader_->housekeep();
    return from_leader_.replies().empty() ? protocol::SessionReply() : from_leader_.replies().back();
  }
  /// And the stand-by is ready.
  protocol::SessionReply join_followed() {
    const protocol::SessionReply reply = join();
    leader_->write_down();
    heir_->housekeep();
    leader_->housekeep();
    return reply;
  }
  void send_state(const protocol::SessionReply& reply) {
    const auto state = testing::hover_state(reply.vehicle, reply.session, ++states_, 50s + (clock_.now() - 100s));
    leader_->on_state(state);
    heir_->on_state(state);
  }
  /// The leader's tick, which the stand-by hears.
  void command() {
    const auto pilot = leader_->session_of("drone");
    ASSERT_TRUE(pilot);
    const auto answer = pilot->stepping().step(clock_.now());
    ASSERT_NE(answer.command, nullptr);
    pilot->stepping().sent(clock_.now(), true);
    newest_ = answer.command->sequence;
    heir_->on_leader_command(*answer.command);
  }
  /// 10 ms at a time: states come, the stand-by looks twice; the leader commands, or it doesn't.
  void fly(const protocol::SessionReply& reply, std::chrono::milliseconds time, bool commands = true) {
    for (auto passed = 0ms; passed < time; passed += 10ms) {
      send_state(reply);
      if (commands) command();
      for (int i = 0; i < 2; ++i) {
        clock_.advance(5ms);
        heir_->look_after();
      }
    }
  }
  static std::size_t count(const std::vector<protocol::PilotRecord>& records, Kind kind) {
    return static_cast<std::size_t>(
        std::count_if(records.begin(), records.end(), [kind](const auto& record) { return record.kind == kind; }));
  }

  ManualClock clock_;
  testing::FakeTransport from_leader_, from_heir_;
  std::unique_ptr<Service> leader_, heir_;
  bool connected_ = true, equals_ = false;
  std::uint64_t states_ = 0, newest_ = 0;
};

TEST_F(TwoServers, TheLeaderAnswersAndTheStandByFollows) {
  const auto reply = join_followed();
  EXPECT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(reply.server, "planner-1");
  EXPECT_TRUE(from_heir_.replies().empty());
  EXPECT_THAT(from_heir_.followed(), ::testing::ElementsAre("drone"));
  EXPECT_GE(count(from_heir_.records(), Kind::kReady), 1u);
  fly(reply, 1s);
  EXPECT_EQ(heir_->sessions(), 0u) << "the leader commands";
  EXPECT_EQ(heir_->strays(), 0u);
}

TEST_F(TwoServers, WhenCommandsStopTheStandByGoesOn) {
  const auto reply = join_followed();
  fly(reply, 200ms);
  leader_->write_down();
  fly(reply, 40ms);  // commands that no record tells of
  fly(reply, 40ms, false);
  EXPECT_EQ(heir_->sessions(), 0u) << "not yet";
  fly(reply, 20ms, false);
  ASSERT_EQ(heir_->sessions(), 1u);
  const auto pilot = heir_->session_of("drone");
  EXPECT_EQ(pilot->session(), reply.session);
  const auto answer = pilot->stepping().step(clock_.now());
  ASSERT_NE(answer.command, nullptr);
  EXPECT_EQ(answer.command->sequence, newest_ + 1) << "counts on from the newest that was heard";
  EXPECT_EQ(answer.command->answers_sequence, states_) << "nothing that came meanwhile is lost";

  ASSERT_EQ(from_heir_.replies().size(), 1u);
  EXPECT_EQ(from_heir_.replies()[0].session, reply.session);
  EXPECT_EQ(from_heir_.replies()[0].server, "planner-2");
  // The leader, if it lives, lets go and says nothing to the vehicle.
  leader_->housekeep();
  EXPECT_EQ(leader_->sessions(), 0u);
  EXPECT_EQ(from_leader_.replies().size(), 1u);
  heir_->housekeep();
  EXPECT_EQ(heir_->sessions(), 1u);
}

TEST_F(TwoServers, AVehicleThatIsSilentIsLeftToTheLeader) {
  const auto reply = join_followed();
  fly(reply, 200ms);
  for (int i = 0; i < 400; ++i) {
    clock_.advance(5ms);
    heir_->look_after();
  }
  EXPECT_EQ(heir_->sessions(), 0u) << "no states: no commands";
  fly(reply, 50ms, false);
  EXPECT_EQ(heir_->sessions(), 0u) << "the leader has its time to hear it again";
  fly(reply, 20ms, false);
  EXPECT_EQ(heir_->sessions(), 1u);
}

TEST_F(TwoServers, AStandByThatWasHeldUpTakesNothing) {
  const auto reply = join_followed();
  fly(reply, 200ms);
  for (int i = 0; i < 30; ++i) {  // its thread doesn't run, and what it would have heard waits
    clock_.advance(10ms);
    send_state(reply);
  }
  heir_->look_after();
  fly(reply, 500ms);
  EXPECT_EQ(heir_->sessions(), 0u);
}

TEST_F(TwoServers, ALeaderThatIsGoneIsNotWaitedFor) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  heir_->on_leader(false);
  heir_->look_after();
  EXPECT_EQ(heir_->sessions(), 1u);
}

TEST_F(TwoServers, ALeaderThatComesBackToLifeLetsGo) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  connected_ = false;
  fly(reply, 100ms, false);
  ASSERT_EQ(heir_->sessions(), 1u);
  leader_->housekeep();
  EXPECT_EQ(leader_->sessions(), 1u) << "it heard nothing";
  connected_ = true;
  leader_->write_down();
  leader_->housekeep();
  EXPECT_EQ(leader_->sessions(), 0u);
  EXPECT_EQ(heir_->sessions(), 1u);
}

TEST_F(TwoServers, DrainingHandsOverAtOnceAndTellsTheVehicle) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  leader_->drain();
  EXPECT_FALSE(leader_->drained());
  leader_->housekeep();
  EXPECT_TRUE(leader_->drained());
  const auto told = from_leader_.replies().back();
  EXPECT_TRUE(told.accepted);
  EXPECT_EQ(told.session, reply.session);
  EXPECT_EQ(told.code, ErrorCode::kLeaving);
  heir_->look_after();
  ASSERT_EQ(heir_->sessions(), 1u);
  EXPECT_EQ(heir_->session_of("drone")->session(), reply.session);
  clock_.advance(1s);
  leader_->housekeep();
  EXPECT_EQ(leader_->figures()->handed_over, 1u);
  heir_->housekeep();
  EXPECT_EQ(heir_->figures()->taken_over, 1u);

  leader_->on_request(join_request("late", 9));
  leader_->housekeep();
  EXPECT_EQ(leader_->sessions(), 0u) << "newcomers are not answered";
  heir_->on_request(join_request("late", 9));
  heir_->housekeep();
  EXPECT_EQ(heir_->sessions(), 2u) << "the stand-by serves them";
}

TEST_F(TwoServers, AServerThatEndsHandsOver) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  leader_->stop();
  heir_->look_after();
  EXPECT_EQ(heir_->sessions(), 1u);
  EXPECT_TRUE(from_leader_.replies().back().accepted);
}

TEST_F(TwoServers, WhatTheStandByIsNotReadyForIsToldAsEver) {
  auto request = join_request();
  request.timing = protocol::Timing::kLockstep;
  const auto reply = join(request);
  ASSERT_TRUE(reply.accepted);
  leader_->write_down();
  heir_->housekeep();
  EXPECT_EQ(count(from_leader_.records(), Kind::kFollow), 0u) << "lockstep has no heir";
  leader_->drain();
  leader_->housekeep();
  EXPECT_FALSE(leader_->drained()) << "it flies to its end";
  leader_->stop();
  EXPECT_FALSE(from_leader_.replies().back().accepted);
  EXPECT_EQ(from_leader_.replies().back().code, ErrorCode::kLeaving);
}

TEST_F(TwoServers, ASessionThatEndsIsForgotten) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  auto goodbye = join_request();
  goodbye.action = protocol::SessionRequest::Action::kLeave;
  leader_->on_request(goodbye);
  leader_->housekeep();
  EXPECT_EQ(count(from_leader_.records(), Kind::kOver), 1u);
  heir_->housekeep();
  EXPECT_THAT(from_heir_.forgotten(), ::testing::ElementsAre("drone"));
  heir_->on_leader(false);
  fly(reply, 100ms, false);
  EXPECT_EQ(heir_->sessions(), 0u);
}

TEST_F(TwoServers, AnHeirThatComesOrGoesIsToldToTheVehicles) {
  join();
  const std::size_t before = from_leader_.replies().size();
  leader_->on_heir(false);
  leader_->housekeep();
  EXPECT_EQ(from_leader_.replies().size(), before + 1);
  EXPECT_TRUE(from_leader_.replies().back().accepted);
}

TEST_F(TwoServers, AStandByServesWhenItsLeaderIsGone) {
  heir_->on_leader(false);
  heir_->on_request(join_request());
  heir_->housekeep();
  ASSERT_EQ(from_heir_.replies().size(), 1u);
  EXPECT_TRUE(from_heir_.replies()[0].accepted);
}

TEST_F(TwoServers, AStandByWaitsAWhileForALeaderThatItNeverSaw) {
  heir_ = make("planner-2", &from_heir_, 0xabc);
  heir_->on_request(join_request());
  heir_->housekeep();
  EXPECT_TRUE(from_heir_.replies().empty());
  clock_.advance(3s);
  heir_->on_request(join_request());
  heir_->housekeep();
  EXPECT_EQ(from_heir_.replies().size(), 1u);
}

TEST_F(TwoServers, AnotherModelCanNotStandBy) {
  heir_ = make("planner-2", &from_heir_, 0xdef);
  heir_->on_leader(true);
  const auto reply = join_followed();
  fly(reply, 100ms);
  EXPECT_EQ(count(from_heir_.records(), Kind::kReady), 0u);
  fly(reply, 200ms, false);
  EXPECT_EQ(heir_->sessions(), 0u);
}

TEST_F(TwoServers, OneThatIsFlownHereIsNotGivenToAnotherClient) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  fly(reply, 100ms, false);
  ASSERT_EQ(heir_->sessions(), 1u);
  leader_->housekeep();
  ASSERT_EQ(leader_->sessions(), 0u);
  // Another client of that name has joined the leader, which lives.
  leader_->on_request(join_request("drone", 77));
  leader_->housekeep();
  leader_->write_down();
  leader_->housekeep();
  EXPECT_EQ(leader_->sessions(), 1u) << "the stand-by says nothing about it";
}

/// Each stands by for the other one; planner-1 has the newcomers.
class TwoEquals : public TwoServers {
 protected:
  TwoEquals() {
    equals_ = true;
    connected_ = false;
    leader_ = make("planner-1", &from_leader_, 0xabc);
    heir_ = make("planner-2", &from_heir_, 0xabc);
    connected_ = true;
    for (const auto& server : {leader_.get(), heir_.get()}) {
      server->on_heir(true);
      server->on_leader(true, server == leader_.get());
    }
  }
};

TEST_F(TwoEquals, TheOneThatLetGoStandsByFromThenOn) {
  const auto reply = join_followed();
  ASSERT_TRUE(reply.accepted);
  EXPECT_TRUE(from_heir_.replies().empty());
  fly(reply, 100ms);
  fly(reply, 100ms, false);
  ASSERT_EQ(heir_->sessions(), 1u);
  leader_->housekeep();
  ASSERT_EQ(leader_->sessions(), 0u);
  heir_->write_down();
  leader_->housekeep();
  EXPECT_EQ(count(from_leader_.records(), Kind::kReady), 1u) << "the other way round";
  EXPECT_EQ(heir_->sessions(), 1u);
}

TEST_F(TwoEquals, OfTwoThatFlyTheSameSessionTheLastOneKeepsIt) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  connected_ = false;  // the leader is held up
  fly(reply, 100ms, false);
  ASSERT_EQ(heir_->sessions(), 1u);
  send_state(reply);
  connected_ = true;
  heir_->write_down();  // whichever is heard first
  leader_->write_down();
  for (int i = 0; i < 2; ++i) leader_->housekeep(), heir_->housekeep();
  EXPECT_EQ(leader_->sessions(), 0u);
  ASSERT_EQ(heir_->sessions(), 1u);
  EXPECT_EQ(heir_->session_of("drone")->take_overs(), 1u);
}

TEST_F(TwoEquals, OneThatIsStartedAgainTakesNothingAway) {
  const auto reply = join_followed();
  fly(reply, 100ms);
  connected_ = false;
  fly(reply, 100ms, false);
  leader_ = make("planner-1", &from_leader_, 0xabc);
  connected_ = true;
  leader_->on_heir(true);
  leader_->on_leader(true, true);
  join();  // it hears the request, which is still there, and answers: a spare's word
  ASSERT_EQ(leader_->sessions(), 1u);
  EXPECT_NE(leader_->session_of("drone")->session(), reply.session);
  heir_->write_down();
  leader_->write_down();
  leader_->housekeep();
  heir_->housekeep();
  EXPECT_EQ(leader_->sessions(), 0u) << "the vehicle has a pilot";
  EXPECT_FALSE(from_leader_.replies().back().accepted) << "the spare is withdrawn";
  ASSERT_EQ(heir_->sessions(), 1u);
  EXPECT_EQ(heir_->session_of("drone")->session(), reply.session);
  heir_->write_down();
  leader_->housekeep();
  EXPECT_GE(count(from_leader_.records(), Kind::kReady), 1u) << "and a stand-by again";
}

}  // namespace
}  // namespace gatefield::service
