// The service with its threads running: several clients, perception and control at once. Run under ThreadSanitizer as
// well; the waits are long enough for that.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/service/service.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::service {
namespace {

using testing::FakePlanner;
using testing::FakeSensor;
using namespace std::chrono_literals;

template <typename Condition>
bool eventually(Condition condition, std::chrono::milliseconds limit = 10s) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

class ServiceThreadsTest : public ::testing::Test {
 protected:
  ServiceThreadsTest() {
    ServiceOptions options;
    options.control_threads = 2;
    options.perception_threads = 2;
    planner::Profile race = testing::small_profile();
    race.control_rate_hz = 200;
    options.profiles = {{"race", race}};
    options.telemetry_period = 10ms;
    service_ = std::make_unique<Service>(options, testing::fake_factories(), &clock_, &transport_);
  }

  protocol::SessionReply join(const protocol::SessionRequest& request) {
    service_->on_request(request);
    protocol::SessionReply reply;
    EXPECT_TRUE(eventually([&] {
      for (const auto& candidate : transport_.replies())
        if (candidate.vehicle == request.vehicle && candidate.request == request.request) {
          reply = candidate;
          return true;
        }
      return false;
    }));
    return reply;
  }
  MonotonicClock clock_;
  testing::FakeTransport transport_;
  std::unique_ptr<Service> service_;
};

TEST_F(ServiceThreadsTest, TwoProducersWhileOneControls) {
  service_->start();
  const auto request = testing::join_request();
  const auto reply = join(request);
  ASSERT_TRUE(reply.accepted) << reply.reason;
  std::atomic<bool> flying{true};
  std::thread states([&] {
    const Stamp begin = clock_.now();
    for (std::uint64_t sequence = 1; flying; ++sequence) {
      const Stamp stamp = 50s + (clock_.now() - begin);
      auto state = testing::hover_state("drone", reply.session, sequence, stamp, {0.5 * seconds(stamp - 50s), 0, 1.5});
      if (sequence % 7 == 0) state.state.p_WB.x() = std::nan("");
      service_->on_state(state);
      std::this_thread::sleep_for(2ms);
    }
  });
  std::thread frames([&] {
    const Stamp begin = clock_.now();
    for (std::uint64_t sequence = 1; flying; ++sequence) {
      auto frame = testing::depth_frame(request, reply.session, sequence, 50s + (clock_.now() - begin));
      service_->on_depth(frame);
      std::this_thread::sleep_for(4ms);
    }
  });
  EXPECT_TRUE(eventually([&] { return transport_.command_count() >= 60; }));
  flying = false;
  states.join();
  frames.join();

  std::uint64_t last = 0;
  bool saw_gate = false;
  for (const auto& command : transport_.commands()) {
    EXPECT_EQ(command.sequence, last + 1);
    last = command.sequence;
    saw_gate = saw_gate || command.health.latent_age_s >= 0;
  }
  EXPECT_TRUE(saw_gate);
  EXPECT_TRUE(eventually([&] {
    const auto telemetries = transport_.telemetries();
    return !telemetries.empty() && telemetries.back().states_rejected > 0;
  }));
  service_->stop();
  const std::size_t at_stop = transport_.command_count();
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(transport_.command_count(), at_stop);
}

TEST_F(ServiceThreadsTest, TheFirstStateIsAnsweredHoweverSoonItComes) {
  transport_.answered = [this](const protocol::SessionReply& reply) {
    if (reply.accepted) service_->on_state(testing::hover_state(reply.vehicle, reply.session, 1, 50s));
  };
  service_->start();
  join(testing::join_request("drone", 1, protocol::Timing::kLockstep));
  EXPECT_TRUE(eventually([&] { return transport_.command_count() == 1; }, 5s)) << "nobody was woken";
  service_->stop();
}

TEST_F(ServiceThreadsTest, LockstepClientsSideBySideEachGetOneAnswerPerState) {
  service_->start();
  std::vector<std::thread> clients;
  std::array<std::uint64_t, 3> sessions{};
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const std::string name = "drone-" + std::to_string(i);
    const auto request = testing::join_request(name, i + 1, protocol::Timing::kLockstep);
    const auto reply = join(request);
    ASSERT_TRUE(reply.accepted) << reply.reason;
    sessions[i] = reply.session;
    clients.emplace_back([this, request, reply, name] {
      for (std::uint64_t sequence = 1; sequence <= 100; ++sequence) {
        const Stamp stamp = 50s + static_cast<std::int64_t>(sequence) * 10ms;
        auto state = testing::hover_state(name, reply.session, sequence, stamp);
        state.depth_sequence = sequence;
        auto frame = testing::depth_frame(request, reply.session, sequence, stamp);
        // Either may come first.
        if (sequence % 2) service_->on_depth(frame);
        service_->on_state(state);
        if (sequence % 2 == 0) service_->on_depth(frame);
        if (!eventually([&] { return transport_.commands_of(reply.session) >= sequence; })) return;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  service_->stop();
  for (const std::uint64_t session : sessions) {
    std::uint64_t expected = 0;
    for (const auto& command : transport_.commands()) {
      if (command.session != session) continue;
      EXPECT_EQ(command.answers_sequence, ++expected);
      EXPECT_FALSE(command.health.degraded);
      EXPECT_EQ(command.health.latent_age_s, 0.0);
    }
    EXPECT_EQ(expected, 100u);
  }
}

TEST_F(ServiceThreadsTest, AMissingFrameDoesNotStopLockstep) {
  service_->start();
  const auto reply = join(testing::join_request("drone", 1, protocol::Timing::kLockstep));
  auto state = testing::hover_state("drone", reply.session, 1, 50s);
  state.depth_sequence = 1;
  const Stamp begin = clock_.now();
  service_->on_state(state);
  ASSERT_TRUE(eventually([&] { return transport_.command_count() == 1; }));
  EXPECT_GE(clock_.now() - begin, pilot::Stepping::kDepthWait);
  EXPECT_TRUE(transport_.commands()[0].health.degraded);
  service_->on_state(state);  // asked again
  ASSERT_TRUE(eventually([&] { return transport_.command_count() == 2; }));
  EXPECT_EQ(transport_.commands()[1].sequence, 1u);
}

TEST_F(ServiceThreadsTest, SessionsComeAndGoWhileOthersFly) {
  service_->start();
  const auto steady = join(testing::join_request("steady", 1));
  std::atomic<bool> flying{true};
  std::thread states([&] {
    for (std::uint64_t sequence = 1; flying; ++sequence) {
      service_->on_state(
          testing::hover_state("steady", steady.session, sequence, 50s + static_cast<std::int64_t>(sequence) * 2ms));
      std::this_thread::sleep_for(2ms);
    }
  });
  for (std::uint64_t i = 1; i <= 20; ++i) {
    auto request = testing::join_request("guest", i);
    const auto reply = join(request);
    ASSERT_TRUE(reply.accepted) << reply.reason;
    service_->on_state(testing::hover_state("guest", reply.session, 1, 50s));
    EXPECT_TRUE(eventually([&] { return transport_.commands_of(reply.session) > 0; }));
    request.action = protocol::SessionRequest::Action::kLeave;
    service_->on_request(request);
    EXPECT_TRUE(eventually([&] { return service_->sessions() == 1; }));
    const std::size_t after = transport_.commands_of(reply.session);
    std::this_thread::sleep_for(10ms);
    EXPECT_EQ(transport_.commands_of(reply.session), after);  // nothing is commanded after the session's end
  }
  flying = false;
  states.join();
  EXPECT_GT(transport_.commands_of(steady.session), 20u);
}

TEST_F(ServiceThreadsTest, LateStepsAreCountedAndDoNotShiftTheOthers) {
  const auto script = std::make_shared<FakePlanner::Script>();
  std::atomic<int> plans{0};
  script->during = [&] {
    if (plans++ == 3) std::this_thread::sleep_for(25ms);  // five periods of 5 ms
  };
  planner::Profile profile = testing::small_profile();
  profile.control_rate_hz = 200;
  pilot::PilotParts parts;
  parts.request = testing::join_request();
  parts.session = 1;
  parts.planner = std::make_unique<FakePlanner>(profile, parts.request.quadrotor, script);
  parts.sensor = std::make_unique<FakeSensor>();
  parts.now = clock_.now();
  const auto flown = std::make_shared<pilot::Pilot>(std::move(parts));
  // Again and again: on a busy machine ten steps can take longer than a client may be silent.
  std::uint64_t states = 0;
  const auto tell = [&] {
    flown->intake().take_state(testing::hover_state("drone", 1, ++states, 50s + states * 1ms), clock_.now());
  };
  tell();
  ControlPool pool({1, false}, &clock_, &transport_);
  pool.add(flown);
  EXPECT_TRUE(eventually([&] {
    tell();
    return plans >= 10;
  }));
  pool.remove(flown.get());
  const int after = plans;
  std::this_thread::sleep_for(15ms);
  EXPECT_EQ(plans, after);
  pool.stop();
  protocol::Telemetry telemetry;
  flown->fill(clock_.now(), &telemetry);
  EXPECT_GE(telemetry.deadlines_missed, 4u);
}

}  // namespace
}  // namespace gatefield::service
