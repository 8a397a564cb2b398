// Who may join the service and who has to go, without its threads.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/logging.h"
#include "common/protocol/validate.h"
#include "tests/support/messages.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using ::testing::HasSubstr;
using testing::join_request;
using namespace std::chrono_literals;

class AdmissionTest : public ::testing::Test {
 protected:
  AdmissionTest() {
    clock_.set(100s);
    options_.name = "pad-1";
    options_.max_vehicles = 4;
    options_.profiles = {{"race", testing::small_profile()}};
    options_.utilisation = 0.5;
    options_.cores_usable = 2.0;
    options_.control_threads = 2;
    options_.costs.learn_step(testing::small_profile(), 4ms);  // 0.4 cores at 100 Hz: two fit into 1
    make();
  }
  void make() { service_ = std::make_unique<Service>(options_, testing::fake_factories(), &clock_, &transport_); }
  protocol::SessionReply ask(const std::string& vehicle, int priority = 5, std::uint64_t number = 1) {
    service_->on_request(request(vehicle, priority, number));
    service_->housekeep();
    const auto replies = transport_.replies();
    for (auto reply = replies.rbegin(); reply != replies.rend(); ++reply)
      if (reply->vehicle == vehicle && reply->request == number) {
        EXPECT_TRUE(protocol::validate(*reply).ok()) << protocol::validate(*reply).error();
        return *reply;
      }
    return {};
  }
  static protocol::SessionRequest request(const std::string& vehicle, int priority, std::uint64_t number) {
    auto made = join_request(vehicle, number);
    made.priority = static_cast<std::uint8_t>(priority);
    return made;
  }
  /// All that have a session send states, and are stepped as their control thread would.
  void fly(std::chrono::nanoseconds span, std::uint64_t late_each = 0) {
    for (const Stamp end = clock_.now() + span; clock_.now() < end;) {
      clock_.advance(50ms);
      ++sequence_;
      for (const auto* vehicle : {"a", "b", "c", "d"}) {
        const auto pilot = service_->session_of(vehicle);
        if (!pilot) continue;
        service_->on_state(testing::hover_state(vehicle, pilot->session(), sequence_, clock_.now()));
        for (int i = 0; i < 5; ++i)
          if (pilot->stepping().step(clock_.now()).command != nullptr) pilot->stepping().solved(1ms);
        pilot->stepping().missed_deadlines(late_each);
      }
      service_->housekeep();
    }
  }

  ManualClock clock_;
  testing::FakeTransport transport_;
  ServiceOptions options_;
  std::unique_ptr<Service> service_;
  std::uint64_t sequence_ = 0;
};

TEST_F(AdmissionTest, ARefusalSaysWhatIsTakenAndWhenToAskAgain) {
  EXPECT_TRUE(ask("a").accepted);
  EXPECT_TRUE(ask("b").accepted);
  const auto third = ask("c");
  EXPECT_FALSE(third.accepted);
  EXPECT_EQ(third.code, ErrorCode::kBusyServer);
  EXPECT_THAT(third.reason, HasSubstr("the server has no room: its 2 vehicles take 0.84 of 1.00 cores"));
  EXPECT_GE(third.retry_after_s, 1.0);
  EXPECT_LE(third.retry_after_s, 2.0);
  EXPECT_NE(third.retry_after_s, ask("c", 5, 2).retry_after_s) << "not all come again at once";
}

TEST_F(AdmissionTest, TheLimitOfVehiclesSaysWhenToAskAgainToo) {
  options_.utilisation = 0.0;
  make();
  for (const auto* vehicle : {"a", "b", "c", "d"}) EXPECT_TRUE(ask(vehicle).accepted);
  const auto fifth = ask("e");
  EXPECT_EQ(fifth.code, ErrorCode::kBusyServer);
  EXPECT_THAT(fifth.reason, HasSubstr("--max-vehicles"));
  EXPECT_GE(fifth.retry_after_s, 1.0);
}

TEST_F(AdmissionTest, HigherPriorityDisplacesTheNewestOfTheLowest) {
  ask("a", 5);
  fly(1s);
  const auto second = ask("b", 5);
  fly(250ms);
  const auto third = ask("c", 7);
  EXPECT_TRUE(third.accepted) << third.reason;
  EXPECT_TRUE(service_->session_of("a"));
  EXPECT_FALSE(service_->session_of("b"));
  for (const auto& reply : transport_.replies()) {
    if (reply.vehicle != "b" || reply.accepted) continue;
    EXPECT_EQ(reply.code, ErrorCode::kBusyServer);
    EXPECT_THAT(reply.reason, HasSubstr("higher priority"));
    EXPECT_GE(reply.retry_after_s, 1.0);
  }
  EXPECT_FALSE(ask("d", 7).accepted && !service_->session_of("c")) << "equals don't displace each other";
  clock_.advance(1s);
  service_->housekeep();
  EXPECT_GE(service_->figures()->sessions_displaced, 1u);
}

TEST_F(AdmissionTest, TheOperatorSaysWhoMayDisplaceOthers) {
  options_.max_priority = 5;
  make();
  ask("a");
  ask("b");
  EXPECT_FALSE(ask("c", 9).accepted);
  EXPECT_TRUE(service_->session_of("b"));
}

TEST_F(AdmissionTest, AFullServerDisplacesForAPlaceToo) {
  options_.utilisation = 0.0;
  make();
  ask("a", 3);
  for (const auto* vehicle : {"b", "c", "d"}) ask(vehicle);
  fly(250ms);
  EXPECT_TRUE(ask("e").accepted);
  EXPECT_FALSE(service_->session_of("a"));
  EXPECT_EQ(service_->sessions(), 4u);
}

TEST_F(AdmissionTest, LateTicksCostTheNewestItsSession) {
  ask("a");
  fly(500ms);
  ask("b");
  ::testing::internal::CaptureStderr();
  log::start("admission_test");
  fly(4s, 1);
  log::start("admission_test", "off");
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(said, HasSubstr("warning deadlines: ")) << "the operator is told before a vehicle is sent away";
  EXPECT_THAT(said, HasSubstr("warning overload: vehicle b is sent away: "));
  EXPECT_TRUE(service_->session_of("a"));
  EXPECT_FALSE(service_->session_of("b"));
  const auto replies = transport_.replies();
  const auto& last = replies.back();
  EXPECT_EQ(last.vehicle, "b");
  EXPECT_EQ(last.code, ErrorCode::kBusyServer);
  EXPECT_THAT(last.reason, HasSubstr("late"));
  EXPECT_GE(last.retry_after_s, 5.0);
  fly(1s, 1);
  EXPECT_TRUE(service_->session_of("a")) << "never the last one";
  EXPECT_EQ(service_->figures()->sessions_shed, 1u);
}

TEST_F(AdmissionTest, OtherServersAreToldHowMuchRoomThereIs) {
  service_->housekeep();
  ASSERT_FALSE(transport_.statuses().empty());
  auto told = transport_.statuses().back();
  EXPECT_TRUE(protocol::validate(told).ok());
  EXPECT_EQ(told.name, "pad-1");
  EXPECT_TRUE(told.accepts);
  EXPECT_NEAR(told.room_cores, 1.0, 1e-9);
  ask("a");
  clock_.advance(250ms);
  service_->housekeep();
  told = transport_.statuses().back();
  EXPECT_EQ(told.sessions, 1u);
  EXPECT_LT(told.room_cores, 0.7);
  service_->drain();
  clock_.advance(250ms);
  service_->housekeep();
  EXPECT_FALSE(transport_.statuses().back().accepts);
  EXPECT_EQ(transport_.statuses().back().room_cores, 0.0);
  const auto refused = ask("b");
  EXPECT_EQ(refused.code, ErrorCode::kBusyServer);
  EXPECT_THAT(refused.reason, HasSubstr("no newcomers"));
  EXPECT_TRUE(ask("a").accepted) << "who is there hears the same as before";
}

TEST_F(AdmissionTest, AServerWithMoreRoomAnswersFirst) {
  auto other = test::good_status("pad-2");
  other.room_cores = 100;
  service_->on_server_status({1}, other);
  EXPECT_EQ(ask("a").request, 0u) << "no answer yet";
  clock_.advance(100ms);
  EXPECT_EQ(ask("a").request, 0u) << "asking again changes nothing";
  clock_.advance(50ms);
  service_->housekeep();
  ASSERT_EQ(transport_.replies().size(), 1u);
  EXPECT_TRUE(transport_.replies().back().accepted) << "a spare's";

  service_->on_request(request("b", 5, 1));
  service_->housekeep();
  service_->on_gone("b", 1);
  clock_.advance(500ms);
  service_->housekeep();
  EXPECT_FALSE(service_->session_of("b")) << "it went while it waited";
  clock_.advance(1s);
  EXPECT_TRUE(ask("c").accepted) << "the other server is silent";
}

TEST_F(AdmissionTest, HoweverManyServersPromiseRoomTheAnswerComesAfterFourTurns) {
  auto other = test::good_status("plenty");
  other.room_cores = 100;
  for (std::uint8_t i = 1; i <= 20; ++i) service_->on_server_status({i}, other);
  EXPECT_EQ(ask("a").request, 0u);
  clock_.advance(590ms);
  service_->housekeep();
  EXPECT_TRUE(transport_.replies().empty());
  clock_.advance(10ms);
  service_->housekeep();
  ASSERT_EQ(transport_.replies().size(), 1u);
  EXPECT_TRUE(transport_.replies().back().accepted);
}

}  // namespace
}  // namespace gatefield::service
