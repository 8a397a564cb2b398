#include "server/service/service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/protocol/validate.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using ::testing::HasSubstr;
using testing::join_request;
using ::testing::StartsWith;
using namespace std::chrono_literals;

/// The service without its threads: tests call housekeep() and step the sessions themselves.
class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest() {
    clock_.set(100s);
    service_ = make();
  }
  std::unique_ptr<Service> make() {
    ServiceOptions options;
    options.name = "pad-1";
    options.max_vehicles = 2;
    options.isa = "avx2";
    options.model_hash = 0xabcdef;
    planner::Profile race = testing::small_profile();
    planner::Profile paper = testing::small_profile();
    paper.name = "paper";
    options.profiles = {{"race", race}, {"paper", paper}};
    Factories factories = testing::fake_factories();
    factories.planner = [this, make = factories.planner](const planner::Profile& profile,
                                                         const protocol::SessionRequest& request) {
      last_seed_ = request.seed;
      ++planners_;
      return make(profile, request);
    };
    if (factory_failure_)
      factories.observer = [this](const planner::Profile&,
                                  const protocol::SessionRequest&) -> Result<std::unique_ptr<pilot::StepObserver>> {
        return *factory_failure_;
      };
    return std::make_unique<Service>(options, factories, &clock_, &transport_);
  }
  /// What the service says to a request.
  protocol::SessionReply ask(const protocol::SessionRequest& request, const Status& verdict = {}) {
    const std::size_t before = transport_.replies().size();
    service_->on_request(request, verdict);
    service_->housekeep();
    const auto replies = transport_.replies();
    EXPECT_EQ(replies.size(), before + 1);
    if (replies.empty()) return {};
    EXPECT_TRUE(protocol::validate(replies.back()).ok()) << protocol::validate(replies.back()).error();
    return replies.back();
  }
  void send_state(const protocol::SessionReply& reply, std::uint64_t sequence, Stamp stamp = 50s) {
    service_->on_state(testing::hover_state(reply.vehicle, reply.session, sequence, stamp));
  }

  ManualClock clock_;
  testing::FakeTransport transport_;
  std::unique_ptr<Service> service_;
  std::uint64_t last_seed_ = 0;
  int planners_ = 0;
  std::optional<Error> factory_failure_;
};

TEST_F(ServiceTest, AcceptsAVehicleAndSaysWhatItGets) {
  auto request = join_request();
  request.seed = 42;
  const auto reply = ask(request);
  EXPECT_TRUE(reply.accepted) << reply.reason;
  EXPECT_EQ(reply.vehicle, "drone");
  EXPECT_EQ(reply.request, 7u);
  EXPECT_EQ(reply.server, "pad-1");
  EXPECT_NE(reply.session, 0u);
  EXPECT_DOUBLE_EQ(reply.control_period_s, 0.01);
  EXPECT_DOUBLE_EQ(reply.plan_step_s, 0.03);
  EXPECT_EQ(reply.plan_steps, 20);
  EXPECT_EQ(reply.model_hash, 0xabcdefu);
  EXPECT_EQ(last_seed_, 42u);

  send_state(reply, 1);
  const auto pilot = service_->session_of("drone");
  ASSERT_TRUE(pilot);
  EXPECT_NE(pilot->stepping().step(clock_.now()).command, nullptr);
}

TEST_F(ServiceTest, SessionNumbersDifferBetweenVehiclesAndStarts) {
  const auto first = ask(join_request("a", 1));
  const auto second = ask(join_request("b", 1));
  EXPECT_NE(first.session, second.session);
  EXPECT_NE(second.session, first.session + 1);  // nobody guesses the next one
  service_ = make();
  EXPECT_NE(ask(join_request("a", 1)).session, first.session);
}

TEST_F(ServiceTest, FiguresCountWhatCameAndOutliveSessions) {
  auto refused = join_request("x");
  refused.profile = "drift";
  ask(refused);
  const auto reply = ask(join_request());
  for (std::uint64_t i = 1; i <= 3; ++i) send_state(reply, i, 50s + i * Stamp(10ms));
  send_state(reply, 3, 50s);  // again
  service_->on_state(testing::hover_state("nobody", 1, 1, 50s));
  auto told = testing::hover_state("drone", reply.session, 4, 50s + 40ms);
  told.round_trip = 20ms;
  service_->on_state(told);
  service_->session_of("drone")->stepping().step(clock_.now());
  service_->session_of("drone")->stepping().solved(1ms);
  clock_.advance(1s);
  service_->housekeep();
  auto figures = service_->figures();
  EXPECT_EQ(figures->made, clock_.now());
  EXPECT_EQ(figures->sessions_begun, 1u);
  EXPECT_EQ(figures->strays, 1u);
  EXPECT_EQ(figures->requests_refused[index(ErrorCode::kUnknownName)], 1u);
  EXPECT_EQ(figures->totals.states_received, 5u);
  EXPECT_EQ(figures->totals.states_rejected, 1u);
  EXPECT_EQ(figures->totals.samples_refused[index(ErrorCode::kNotRising)], 1u);
  EXPECT_EQ(figures->totals.steps.all(), 1u);
  ASSERT_EQ(figures->vehicles.size(), 1u);
  EXPECT_EQ(figures->vehicles[0].telemetry.vehicle, "drone");
  EXPECT_DOUBLE_EQ(figures->vehicles[0].silent_s, 1.0);
  EXPECT_DOUBLE_EQ(figures->vehicles[0].round_trip_s, 0.02);

  auto leave = join_request();
  leave.action = protocol::SessionRequest::Action::kLeave;
  service_->on_request(leave);
  clock_.advance(1s);
  service_->housekeep();
  figures = service_->figures();
  EXPECT_TRUE(figures->vehicles.empty());
  EXPECT_EQ(figures->totals.states_received, 5u);
  EXPECT_EQ(figures->totals.steps.all(), 1u);
}

TEST_F(ServiceTest, ProfilesAreExchangedForSessionsToCome) {
  const auto before = ask(join_request("a", 1));
  planner::Profile slow = testing::small_profile();
  slow.name = "race";
  slow.step_s = 0.05;
  service_->set_profiles({{"race", slow}});
  EXPECT_DOUBLE_EQ(ask(join_request("b", 1)).plan_step_s, 0.05);
  EXPECT_DOUBLE_EQ(ask(join_request("a", 1)).plan_step_s, before.plan_step_s) << "it keeps what it began with";
  auto gone = join_request("c", 1);
  gone.profile = "paper";
  EXPECT_FALSE(ask(gone).accepted);
}

TEST_F(ServiceTest, TheSameRequestGetsTheSameReply) {
  const auto first = ask(join_request());
  const auto again = ask(join_request());
  EXPECT_TRUE(again.accepted);
  EXPECT_EQ(again.session, first.session);
  EXPECT_EQ(service_->sessions(), 1u);
}

TEST_F(ServiceTest, RefusalsNameFieldValueAndExpectation) {
  struct Case {
    std::function<void(protocol::SessionRequest&)> spoil;
    const char* field;
    const char* value;
    const char* expected;  // a part of it
    ErrorCode code = ErrorCode::kInvalid;
  };
  const std::vector<Case> cases{
      {[](auto& r) { r.version = 1; }, "version", "1", "2 (the protocol version", ErrorCode::kVersion},
      {[](auto& r) { r.profile = "drift"; }, "profile", "\"drift\"", "paper, race", ErrorCode::kUnknownName},
      {[](auto& r) { r.quadrotor.mass_kg = 0; }, "quadrotor.mass_kg", "0", ""},
      {[](auto& r) { r.quadrotor.thrust_max_n = 1.5; }, "quadrotor.thrust_max_n", "1.5", "weight"},
      {[](auto& r) { r.course.waypoints.clear(); }, "course.waypoints", "0 long", "1 to 64"},
      {[](auto& r) { r.camera.width_px = 4; }, "camera.width_px", "4", "16"},
      {[](auto& r) {
         r.actuation.kind = Actuation::Kind::kBodyRates;
         r.actuation.thrust_time_constant_s = 0.02;
         r.actuation.rate_time_constant_s = Eigen::Vector3d(0.03, 30, 0.1);
       },
       "actuation.rate_time_constant_s[1]", "30 s", "0.001 to 1 s"},
  };
  for (const Case& bad : cases) {
    auto request = join_request();
    bad.spoil(request);
    const auto reply = ask(request);
    EXPECT_FALSE(reply.accepted) << bad.field;
    EXPECT_EQ(reply.session, 0u);
    EXPECT_EQ(reply.code, bad.code) << bad.field;
    EXPECT_EQ(reply.version, request.version) << "a client of another version reads its own";
    EXPECT_EQ(reply.field, bad.field);
    EXPECT_EQ(reply.value, bad.value);
    EXPECT_THAT(reply.expected, HasSubstr(bad.expected));
    EXPECT_THAT(reply.reason, HasSubstr(reply.field + " is " + reply.value));
  }
  EXPECT_EQ(service_->sessions(), 0u);
}

TEST_F(ServiceTest, ARefusalFitsTheWireHoweverLongAndOddItsTexts) {
  factory_failure_ = Error::invalid("trace\x1b[2J", std::string(1000, 'v'), std::string(1000, '\n'));
  service_ = make();
  const auto reply = ask(join_request());  // validates it
  EXPECT_EQ(reply.field, "trace?[2J");
  EXPECT_EQ(reply.value, std::string(protocol::kMaxFieldLength, 'v'));
  EXPECT_EQ(reply.reason.size(), protocol::kMaxReasonLength);
}

TEST_F(ServiceTest, WhatAFactoryRefusesIsToldToTheVehicle) {
  factory_failure_ = Error("trace drone.trace can't be written", ErrorCode::kUnreadable);
  service_ = make();
  const auto reply = ask(join_request());
  EXPECT_FALSE(reply.accepted);
  EXPECT_EQ(reply.code, ErrorCode::kUnreadable);
  EXPECT_THAT(reply.reason, HasSubstr("drone.trace"));
  EXPECT_EQ(service_->sessions(), 0u);
}

TEST_F(ServiceTest, RefusesWhatTheWireFoundWrong) {
  const auto reply = ask(join_request(), Error::invalid("course.waypoints", "4000000000 long", "1 to 64"));
  EXPECT_FALSE(reply.accepted);
  EXPECT_EQ(reply.code, ErrorCode::kInvalid);
  EXPECT_THAT(reply.reason, HasSubstr("4000000000"));
}

TEST_F(ServiceTest, ANameInUseIsBusyUntilItFallsSilent) {
  const auto mine = ask(join_request("drone", 7));
  send_state(mine, 1);
  clock_.advance(900ms);
  const auto refused = ask(join_request("drone", 8));
  EXPECT_FALSE(refused.accepted);
  EXPECT_EQ(refused.code, ErrorCode::kBusyName);
  EXPECT_EQ(refused.field, "vehicle");
  EXPECT_EQ(refused.value, "\"drone\"");
  EXPECT_THAT(refused.reason, StartsWith("vehicle \"drone\" has a session whose last state came 900 ms ago"));
  EXPECT_EQ(refused.request, 8u);

  clock_.advance(200ms);
  const auto taken = ask(join_request("drone", 8));
  EXPECT_TRUE(taken.accepted) << taken.reason;
  EXPECT_NE(taken.session, mine.session);
  EXPECT_EQ(service_->sessions(), 1u);
  // The old client's samples don't reach the new session.
  send_state(mine, 2, 51s);
  EXPECT_EQ(service_->session_of("drone")->stepping().step(clock_.now()).command, nullptr);
  protocol::Telemetry telemetry;
  service_->session_of("drone")->fill(clock_.now(), &telemetry);
  EXPECT_EQ(telemetry.states_rejected, 1u);
}

TEST_F(ServiceTest, FullMeansBusyAndASilentSessionMakesRoom) {
  const auto first = ask(join_request("a", 1));
  ask(join_request("b", 1));
  const auto refused = ask(join_request("c", 1));
  EXPECT_FALSE(refused.accepted);
  EXPECT_EQ(refused.code, ErrorCode::kBusyServer);
  EXPECT_THAT(refused.reason, StartsWith("the server flies 2 vehicles"));
  EXPECT_EQ(planners_, 2) << "a vehicle that gets no place gets no planner either";

  clock_.advance(2s);
  send_state(first, 1);  // "a" is alive, "b" is not
  service_->on_request(join_request("c", 2));
  service_->housekeep();
  EXPECT_TRUE(service_->session_of("a"));
  EXPECT_FALSE(service_->session_of("b"));
  EXPECT_TRUE(service_->session_of("c"));
  EXPECT_THAT(transport_.forgotten(), ::testing::ElementsAre("b"));
}

TEST_F(ServiceTest, NoSessionGivesWayToAVehicleThatIsRefused) {
  ask(join_request("a", 1));
  ask(join_request("b", 1));
  clock_.advance(2s);  // both are silent
  auto nonsense = join_request("c", 1);
  nonsense.profile = "nonsense";
  EXPECT_EQ(ask(nonsense).code, ErrorCode::kUnknownName);
  EXPECT_EQ(service_->sessions(), 2u);
  EXPECT_TRUE(service_->session_of("a") && service_->session_of("b"));
}

TEST_F(ServiceTest, LeavingAndBeingGoneEndTheSession) {
  auto request = join_request();
  ask(request);
  request.action = protocol::SessionRequest::Action::kLeave;
  service_->on_request(request);
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 0u);
  EXPECT_THAT(transport_.forgotten(), ::testing::ElementsAre("drone"));

  ask(join_request("drone", 8));
  service_->on_gone("drone", 7);  // old news
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 1u);
  service_->on_gone("drone", 8);
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 0u);
}

TEST_F(ServiceTest, AStrangerCantEndASession) {
  ask(join_request("drone", 7));
  auto leave = join_request("drone", 9);
  leave.action = protocol::SessionRequest::Action::kLeave;
  service_->on_request(leave);
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 1u);
}

TEST_F(ServiceTest, AnAbandonedSessionEndsAndIsTold) {
  ask(join_request());
  clock_.advance(9s);
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 1u);
  clock_.advance(2s);
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 0u);
  const auto last = transport_.replies().back();
  EXPECT_FALSE(last.accepted);
  EXPECT_EQ(last.request, 7u);
  EXPECT_EQ(last.code, ErrorCode::kAbandoned);
  EXPECT_THAT(last.reason, HasSubstr("no state came"));
}

TEST_F(ServiceTest, SamplesOfUnknownVehiclesAreCounted) {
  service_->on_state(testing::hover_state("nobody", 1, 1, 50s));
  auto frame = testing::depth_frame(join_request("nobody"), 1, 1, 50s);
  service_->on_depth(frame);
  service_->on_rejected(Service::Kind::kState, "nobody", Error("p_WB is (nan, 0, 0)"));
  EXPECT_EQ(service_->strays(), 3u);
}

TEST_F(ServiceTest, WhatTheWireRejectedIsCountedWithTheVehicle) {
  const auto reply = ask(join_request());
  service_->on_rejected(Service::Kind::kState, "drone", Error("p_WB is (nan, 0, 0), expected finite"));
  service_->on_rejected(Service::Kind::kDepth, "drone", Error("encoding is 9, expected 0 or 1"));
  clock_.advance(500ms);
  service_->housekeep();
  ASSERT_FALSE(transport_.telemetries().empty());
  const auto telemetry = transport_.telemetries().back();
  EXPECT_EQ(telemetry.session, reply.session);
  EXPECT_EQ(telemetry.states_rejected, 1u);
  EXPECT_EQ(telemetry.frames_rejected, 1u);
  EXPECT_THAT(telemetry.last_reason, HasSubstr("encoding is 9"));
}

TEST_F(ServiceTest, TelemetryComesTwiceASecond) {
  ask(join_request());
  const std::size_t before = transport_.telemetries().size();
  for (int i = 0; i < 40; ++i) {
    clock_.advance(50ms);
    service_->housekeep();
  }
  EXPECT_EQ(transport_.telemetries().size() - before, 4u);
  EXPECT_TRUE(protocol::validate(transport_.telemetries().back()).ok());
}

TEST_F(ServiceTest, TelemetrySaysOfTheNewestRejectedSampleWhatWasWrong) {
  ask(join_request());
  service_->on_rejected(Service::Kind::kState, "drone", Error::invalid("q_WB", "of norm 2", "norm 1"));
  clock_.advance(500ms);
  service_->housekeep();
  const auto telemetry = transport_.telemetries().back();
  EXPECT_EQ(telemetry.last_code, ErrorCode::kInvalid);
  EXPECT_EQ(telemetry.last_field, "q_WB");
  EXPECT_EQ(telemetry.last_value, "of norm 2");
  EXPECT_EQ(telemetry.last_expected, "norm 1");
  EXPECT_EQ(telemetry.last_reason, "state: q_WB is of norm 2, expected norm 1");
}

TEST_F(ServiceTest, ANewProblemIsToldAtOnceThoughNoCommandGoesOut) {
  const auto reply = ask(join_request());
  send_state(reply, 1);
  const auto pilot = service_->session_of("drone");
  EXPECT_NE(pilot->stepping().step(clock_.now()).command, nullptr);
  pilot->stepping().solved(1ms);
  clock_.advance(500ms);
  service_->housekeep();
  const std::size_t before = transport_.telemetries().size();
  EXPECT_EQ(transport_.telemetries().back().health.problems, 0u);

  clock_.advance(50ms);
  EXPECT_EQ(pilot->stepping().step(clock_.now()).command, nullptr);  // silent for too long
  service_->housekeep();
  ASSERT_EQ(transport_.telemetries().size(), before + 1) << "before its time";
  EXPECT_EQ(transport_.telemetries().back().health.problems, protocol::bit(protocol::Problem::kStatesMissing));
  for (int i = 0; i < 8; ++i) {
    clock_.advance(50ms);
    pilot->stepping().step(clock_.now());
    service_->housekeep();
  }
  EXPECT_EQ(transport_.telemetries().size(), before + 1) << "once";
}

TEST_F(ServiceTest, LeavingServersSaySo) {
  ask(join_request("a", 1));
  ask(join_request("b", 2));
  service_->stop();
  const auto replies = transport_.replies();
  ASSERT_EQ(replies.size(), 4u);
  for (std::size_t i = 2; i < 4; ++i) {
    EXPECT_FALSE(replies[i].accepted);
    EXPECT_EQ(replies[i].code, ErrorCode::kLeaving);
    EXPECT_THAT(replies[i].reason, HasSubstr("leaving"));
  }
  EXPECT_EQ(replies[2].request, 1u);
  service_->on_request(join_request("c", 3));
  service_->housekeep();
  EXPECT_EQ(service_->sessions(), 0u);
}

TEST_F(ServiceTest, AFloodOfRequestsIsBounded) {
  for (std::uint64_t i = 1; i <= 10000; ++i) {
    auto request = join_request(std::string("v").append(std::to_string(i)), i);
    request.profile = "drift";
    service_->on_request(request);
  }
  service_->housekeep();
  EXPECT_LE(transport_.replies().size(), 256u);
}

TEST_F(ServiceTest, RequestsWithoutEndLeaveTheRestOfHousekeepingItsTurn) {
  const auto session = ask(join_request("a", 1));
  auto refused = join_request("b", 2);
  refused.profile = "drift";
  int asked = 0;
  transport_.answered = [&](const protocol::SessionReply&) {
    if (++asked < 1000) service_->on_request(refused);  // whoever is refused asks again at once
  };
  service_->on_request(refused);
  send_state(session, 1);
  clock_.advance(600ms);
  const std::size_t before = transport_.telemetries().size();
  service_->housekeep();
  EXPECT_EQ(asked, 1);
  EXPECT_GT(transport_.telemetries().size(), before);
}

}  // namespace
}  // namespace gatefield::service
