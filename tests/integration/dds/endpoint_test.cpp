#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <functional>
#include <future>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/random.h"
#include "common/dds/client_endpoint.h"
#include "common/dds/convert.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/server_endpoint.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "tests/integration/dds/raw_type.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;
using test::own_domain;

// What came in, with a wait for a condition on it.
class Log {
 public:
  template <typename Change>
  void change(Change&& apply) {
    {
      const std::lock_guard lock(mutex_);
      apply();
    }
    changed_.notify_all();
  }
  template <typename Condition>
  bool wait(Condition&& condition, std::chrono::milliseconds limit = 5000ms) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, limit, condition);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
};

struct RecordingServer : ServerHandler, Log {
  std::vector<std::pair<protocol::SessionRequest, std::string>> requests;  // with the verdict's sentence
  std::vector<protocol::VehicleState> states;
  std::vector<protocol::DepthFrame> frames;
  std::vector<std::pair<std::string, std::uint64_t>> gone;
  std::vector<std::pair<Topic, Error>> rejected;
  std::vector<ParticipantId> namesakes;

  void on_namesake(const ParticipantId& participant) override {
    change([&] { namesakes.push_back(participant); });
  }
  void on_session_request(const protocol::SessionRequest& request, const Status& verdict) override {
    change([&] { requests.emplace_back(request, verdict.error()); });
  }
  void on_state(const protocol::VehicleState& state) override {
    change([&] { states.push_back(state); });
  }
  void on_depth(protocol::DepthFrame& frame) override {
    change([&] {
      frames.push_back(frame);
      frame.pixels.clear();  // as if taken
    });
  }
  void on_vehicle_gone(const std::string& vehicle, std::uint64_t request) override {
    change([&] { gone.emplace_back(vehicle, request); });
  }
  void on_rejected(Topic topic, const std::string&, const Error& why) override {
    change([&] { rejected.emplace_back(topic, why); });
  }
};

struct RecordingClient : ClientHandler, Log {
  std::vector<protocol::SessionReply> replies;
  std::vector<protocol::ThrustRateCommand> commands;
  std::vector<protocol::Telemetry> telemetry;
  std::vector<std::string> rejected;

  void on_reply(const protocol::SessionReply& reply, const ParticipantId&) override {
    change([&] { replies.push_back(reply); });
  }
  void on_command(const protocol::ThrustRateCommand& command, const ParticipantId&) override {
    change([&] { commands.push_back(command); });
  }
  void on_telemetry(const protocol::Telemetry& message) override {
    change([&] { telemetry.push_back(message); });
  }
  void on_rejected(Topic, const std::string& reason) override {
    change([&] { rejected.push_back(reason); });
  }
};

template <typename T>
T must(Result<T> result) {
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error());
  if (!result.ok()) std::abort();
  return std::move(result).value();
}

// Best-effort samples may be lost before discovery is through: sent until seen.
template <typename Send, typename Seen>
bool send_until(Send&& send, Seen&& seen, std::chrono::milliseconds limit = 5000ms) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    send();
    if (seen(50ms)) return true;
  }
  return false;
}

TEST(Endpoint, CarriesEveryMessageBothWays) {
  RecordingServer server_log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &server_log));
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));

  ASSERT_TRUE(client->publish(test::good_request()).ok());
  ASSERT_TRUE(server_log.wait([&] { return !server_log.requests.empty(); }));
  EXPECT_EQ(server_log.requests[0].second, "");
  EXPECT_EQ(server_log.requests[0].first.request, 7u);
  EXPECT_EQ(server_log.requests[0].first.course.waypoints.size(), 3u);

  ASSERT_TRUE(server->publish(test::good_reply()).ok());
  ASSERT_TRUE(client_log.wait([&] { return !client_log.replies.empty(); }));
  EXPECT_EQ(client_log.replies[0].server, "planner-1");

  EXPECT_TRUE(
      send_until([&] { client->publish(test::good_state()); },
                 [&](auto limit) { return server_log.wait([&] { return !server_log.states.empty(); }, limit); }));
  EXPECT_EQ(server_log.states[0].state.p_WB, test::good_state().state.p_WB);

  protocol::DepthFrame frame = test::good_frame();
  ASSERT_TRUE(client->publish(frame));
  EXPECT_EQ(frame.pixels, test::good_frame().pixels) << "the lent pixels did not come back";
  ASSERT_TRUE(server_log.wait([&] { return !server_log.frames.empty(); }));
  EXPECT_EQ(server_log.frames[0].pixels, frame.pixels);

  EXPECT_TRUE(
      send_until([&] { server->publish(test::good_command()); },
                 [&](auto limit) { return client_log.wait([&] { return !client_log.commands.empty(); }, limit); }));
  EXPECT_EQ(client_log.commands[0].rotor_thrust_n[19], test::good_command().rotor_thrust_n[19]);

  EXPECT_TRUE(
      send_until([&] { server->publish(test::good_telemetry()); },
                 [&](auto limit) { return client_log.wait([&] { return !client_log.telemetry.empty(); }, limit); }));
  EXPECT_EQ(client_log.telemetry[0].last_reason, test::good_telemetry().last_reason);
}

TEST(Endpoint, CarriesTheLongestPlanAndALargeImage) {
  RecordingServer server_log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &server_log));
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(client->publish(test::good_request()).ok());
  ASSERT_TRUE(server_log.wait([&] { return !server_log.requests.empty(); }));
  ASSERT_TRUE(server->publish(test::good_reply()).ok());
  ASSERT_TRUE(client_log.wait([&] { return !client_log.replies.empty(); }));

  EXPECT_TRUE(
      send_until([&] { server->publish(test::good_command("drone", 1, protocol::kMaxPlanSteps)); },
                 [&](auto limit) { return client_log.wait([&] { return !client_log.commands.empty(); }, limit); }));
  EXPECT_EQ(client_log.commands[0].steps, protocol::kMaxPlanSteps);

  protocol::DepthFrame frame = test::good_frame("drone", 1, 640, 480);
  ASSERT_TRUE(
      send_until([&] { client->publish(frame); },
                 [&](auto limit) { return server_log.wait([&] { return !server_log.frames.empty(); }, limit); }));
  EXPECT_EQ(server_log.frames[0].pixels, frame.pixels);
}

TEST(Endpoint, CommandsReachTheirOwnVehicleOnlyAndEndWithTheSession) {
  RecordingServer server_log;
  RecordingClient own_log, other_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &server_log));
  auto own = must(ClientEndpoint::create(own_domain(), "own", &own_log));
  auto other = must(ClientEndpoint::create(own_domain(), "other", &other_log));

  EXPECT_FALSE(server->publish(test::good_command("own"))) << "commands before the session was accepted";
  ASSERT_TRUE(server->publish(test::good_reply("own")).ok());
  ASSERT_TRUE(server->publish(test::good_reply("other")).ok());
  EXPECT_TRUE(send_until([&] { server->publish(test::good_command("own")); },
                         [&](auto limit) { return own_log.wait([&] { return !own_log.commands.empty(); }, limit); }));
  EXPECT_TRUE(
      send_until([&] { server->publish(test::good_command("other")); },
                 [&](auto limit) { return other_log.wait([&] { return !other_log.commands.empty(); }, limit); }));
  EXPECT_FALSE(own_log.wait([&] { return own_log.commands.back().vehicle != "own"; }, 200ms));
  for (const auto& command : other_log.commands) EXPECT_EQ(command.vehicle, "other");

  server->drop_vehicle("own");
  EXPECT_FALSE(server->publish(test::good_command("own")));
  EXPECT_TRUE(server->publish(test::good_command("other")));
}

TEST(Endpoint, SamplesFlowAgainAfterASilence) {
  RecordingServer server_log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &server_log));
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(client->publish(test::good_request()).ok());
  ASSERT_TRUE(server_log.wait([&] { return !server_log.requests.empty(); }));
  ASSERT_TRUE(server->publish(test::good_reply()).ok());
  for (std::uint64_t round = 1; round <= 3; ++round) {
    EXPECT_TRUE(send_until(
        [&] { client->publish(test::good_state("drone", round)); },
        [&](auto limit) {
          return server_log.wait(
              [&] { return !server_log.states.empty() && server_log.states.back().sequence == round; }, limit);
        },
        2000ms));
    EXPECT_TRUE(send_until(
        [&] { server->publish(test::good_command("drone", round)); },
        [&](auto limit) {
          return client_log.wait(
              [&] { return !client_log.commands.empty() && client_log.commands.back().sequence == round; }, limit);
        },
        2000ms));
    std::this_thread::sleep_for(400ms);  // past deadline and liveliness of both
  }
}

TEST(ServerName, OfTwoServersBothServeAndBothSaySo) {
  RecordingServer first_log, second_log, other_log;
  RecordingClient client_log;
  auto first = must(ServerEndpoint::create(own_domain(), "planner-1", &first_log));
  auto second = must(ServerEndpoint::create(own_domain(), "planner-1", &second_log));
  auto other = must(ServerEndpoint::create(own_domain(), "planner-2", &other_log));
  EXPECT_TRUE(first_log.wait([&] { return !first_log.namesakes.empty(); }));
  EXPECT_TRUE(second_log.wait([&] { return !second_log.namesakes.empty(); }));
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(client->publish(test::good_request()).ok());
  for (RecordingServer* log : {&first_log, &second_log, &other_log})
    EXPECT_TRUE(log->wait([&] { return !log->requests.empty(); }));
  EXPECT_FALSE(first_log.wait([&] { return first_log.namesakes.size() > 1; }, 300ms)) << "each is told once";
  EXPECT_TRUE(other_log.namesakes.empty());
}

TEST(ServerName, BadNamesAndDomainsAreRefused) {
  RecordingServer log;
  EXPECT_FALSE(ServerEndpoint::create(own_domain(), "two words", &log).ok());
  EXPECT_FALSE(ServerEndpoint::create(233, "planner-1", &log).ok());
  RecordingClient client_log;
  EXPECT_FALSE(ClientEndpoint::create(own_domain(), "", &client_log).ok());
}

TEST(Leaving, AGoodbyeIsReportedOnceWithTheRequestItEnds) {
  RecordingServer log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(client->publish(test::good_request("drone", 77)).ok());
  ASSERT_TRUE(log.wait([&] { return !log.requests.empty(); }));
  client.reset();
  ASSERT_TRUE(log.wait([&] { return !log.gone.empty(); }));
  EXPECT_EQ(log.gone[0], std::make_pair(std::string("drone"), std::uint64_t{77}));
  EXPECT_FALSE(log.wait([&] { return log.gone.size() > 1; }, 300ms));
}

TEST(Leaving, WhileSamplesPourInAReaderGoesWithoutWaitingForItself) {
  // A receiving thread holds the middleware's lock and wants the reader; the deletion holds the reader and wants that
  // lock.
  RecordingServer log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  std::atomic<bool> stop{false};
  std::thread talker([&] {
    while (!stop) {
      server->publish(test::good_telemetry("drone"));
      std::this_thread::sleep_for(20us);
    }
  });
  auto visits = std::async(std::launch::async, [] {
    for (int visit = 0; visit < 25; ++visit) {
      RecordingClient client_log;
      auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
      client_log.wait([&] { return client_log.telemetry.size() > 20; }, 1000ms);
    }
  });
  const bool ended = visits.wait_for(60s) == std::future_status::ready;
  EXPECT_TRUE(ended);
  if (!ended) std::_Exit(1);  // nothing can end threads that wait for each other
  stop = true;
  talker.join();
}

TEST(Leaving, AnotherClientOfTheSameNameEndsOnlyItsOwnRequest) {
  RecordingServer log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  auto first = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  auto second = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(first->publish(test::good_request("drone", 1)).ok());
  ASSERT_TRUE(log.wait([&] { return log.requests.size() == 1; }));
  ASSERT_TRUE(second->publish(test::good_request("drone", 2)).ok());
  ASSERT_TRUE(log.wait([&] { return log.requests.size() == 2; }));
  second.reset();
  ASSERT_TRUE(log.wait([&] { return !log.gone.empty(); }));
  EXPECT_EQ(log.gone[0].second, 2u);
  EXPECT_FALSE(log.wait([&] { return log.gone.size() > 1; }, 300ms));
}

// Runs in a process of its own (main below), because it has to die without a word.
int child_that_joins(std::uint32_t domain) {
  RecordingClient log;
  auto client = must(ClientEndpoint::create(domain, "victim", &log));
  if (!client->publish(test::good_request("victim", 99)).ok()) return 1;
  std::this_thread::sleep_for(30s);
  return 0;
}

TEST(Leaving, AClientThatIsKilledIsReportedWhenItsLeaseRunsOut) {
  RecordingServer log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  const pid_t child = fork();
  if (child == 0) {
    setenv("GATEFIELD_TEST_CHILD_DOMAIN", std::getenv("GATEFIELD_TEST_DOMAIN"), 1);  // the parent's
    execl("/proc/self/exe", "endpoint_test", static_cast<char*>(nullptr));
    _exit(127);
  }
  const bool joined = log.wait([&] { return !log.requests.empty(); }, 8000ms);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ASSERT_TRUE(joined);
  ASSERT_TRUE(log.wait([&] { return !log.gone.empty(); }, 6000ms));
  EXPECT_EQ(log.gone[0], std::make_pair(std::string("victim"), std::uint64_t{99}));
}

TEST(Restart, ANewServerGetsTheRequestByItself) {
  RecordingServer log;
  RecordingClient client_log;
  auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
  ASSERT_TRUE(client->publish(test::good_request()).ok());
  for (std::size_t start = 1; start <= 2; ++start) {
    auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
    ASSERT_TRUE(log.wait([&] { return log.requests.size() >= start; })) << "start " << start;
    ASSERT_TRUE(server->publish(test::good_reply()).ok());
    ASSERT_TRUE(client_log.wait([&] { return client_log.replies.size() >= start; }));
  }
}

TEST(Many, VehiclesMayComeAndGoWithoutEnd) {
  // More names than a reader or writer keeps apart at a time; one client hears it all go by.
  RecordingServer log;
  RecordingClient bystander_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  auto bystander = must(ClientEndpoint::create(own_domain(), "bystander", &bystander_log));
  auto participant = must(Participant::open(own_domain(), "crowd", "", {}, [](const PeerEvent&) {}));
  auto requests = must(Writer<wire::SessionRequestPubSubType>::open(participant.get(), Topic::kSessionRequest));
  auto states = must(Writer<wire::VehicleStatePubSubType>::open(participant.get(), Topic::kVehicleState));
  for (std::size_t i = 0; i < 600; ++i) {
    std::string name("v");
    name += std::to_string(i);
    // Again until it is heard: this writer has its limit of names, and a participant its limit of requests a second.
    ASSERT_TRUE(send_until(
        [&] { requests->write([&](auto* sample) { to_wire(test::good_request(name, i + 1), sample); }); },
        [&](auto limit) {
          return log.wait([&] { return !log.requests.empty() && log.requests.back().first.request == i + 1; }, limit);
        }))
        << name;
    protocol::SessionReply reply = test::good_reply(name, i + 1);
    reply.accepted = i % 3 == 0;
    if (!reply.accepted) reply.reason = "not today";
    ASSERT_TRUE(server->publish(reply).ok()) << name;
    const auto heard = [&](auto limit) {
      return log.wait([&] { return !log.states.empty() && log.states.back().sequence == i + 1; }, limit);
    };
    const auto send = [&] { states->write([&](auto* sample) { to_wire(test::good_state(name, i + 1), sample); }); };
    if (reply.accepted)
      ASSERT_TRUE(send_until(send, heard, 1000ms)) << name;
    else
      send();  // of a vehicle without a session
    requests->withdraw(name);
    states->withdraw(name);
    ASSERT_TRUE(log.wait([&] { return log.gone.size() > i; })) << name;
    server->drop_vehicle(name);
  }
  ASSERT_TRUE(server->publish(test::good_reply("bystander")).ok());
  EXPECT_TRUE(bystander_log.wait([&] { return !bystander_log.replies.empty(); }));
}

TEST(Many, AVehicleMayLeaveAndComeBack) {
  RecordingServer log;
  RecordingClient client_log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  for (std::uint64_t visit = 1; visit <= 3; ++visit) {
    auto client = must(ClientEndpoint::create(own_domain(), "drone", &client_log));
    ASSERT_TRUE(client->publish(test::good_request("drone", visit)).ok());
    ASSERT_TRUE(log.wait([&] { return log.requests.size() == visit; }));
    ASSERT_TRUE(server->publish(test::good_reply("drone", visit)).ok());
    ASSERT_TRUE(
        client_log.wait([&] { return !client_log.replies.empty() && client_log.replies.back().request == visit; }));
    EXPECT_TRUE(send_until(
        [&] { server->publish(test::good_command("drone", visit)); },
        [&](auto limit) {
          return client_log.wait(
              [&] { return !client_log.commands.empty() && client_log.commands.back().sequence == visit; }, limit);
        }));
    client.reset();
    ASSERT_TRUE(log.wait([&] { return log.gone.size() == visit; }));
    server->drop_vehicle("drone");
  }
}

TEST(Many, VehiclesAreCommandedFromThreadsOfTheirOwn) {
  RecordingServer log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  constexpr int kVehicles = 3;
  constexpr std::uint64_t kCommands = 200;
  std::vector<RecordingClient> logs(kVehicles);
  std::vector<std::unique_ptr<ClientEndpoint>> clients;
  std::vector<std::thread> threads;
  for (int i = 0; i < kVehicles; ++i) {
    const std::string name = std::string("vehicle-of-thread-") + static_cast<char>('a' + i);
    auto& client_log = logs[static_cast<std::size_t>(i)];
    clients.push_back(must(ClientEndpoint::create(own_domain(), name, &client_log)));
    ASSERT_TRUE(server->publish(test::good_reply(name)).ok());
    ASSERT_TRUE(client_log.wait([&] { return !client_log.replies.empty(); }));
    threads.emplace_back([&server, name] {
      for (std::uint64_t k = 1; k <= kCommands; ++k) {
        EXPECT_TRUE(server->publish(test::good_command(name, k)));
        std::this_thread::sleep_for(1ms);
      }
    });
  }
  for (auto& thread : threads) thread.join();
  for (int i = 0; i < kVehicles; ++i) {
    auto& client_log = logs[static_cast<std::size_t>(i)];
    const char last = static_cast<char>('a' + i);
    // Reliable, depth 1: one may be replaced by its successor, but the last one comes.
    EXPECT_TRUE(client_log.wait(
        [&] { return !client_log.commands.empty() && client_log.commands.back().sequence == kCommands; }));
    for (const auto& command : client_log.commands) EXPECT_EQ(command.vehicle.back(), last);
    EXPECT_TRUE(client_log.rejected.empty());
  }
}

TEST(BadInput, RequestsComeWithTheSentenceToRefuseThem) {
  RecordingServer log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  auto participant = must(Participant::open(own_domain(), "stranger", "", {}, [](const PeerEvent&) {}));
  auto writer = must(Writer<wire::SessionRequestPubSubType>::open(participant.get(), Topic::kSessionRequest));
  protocol::SessionRequest bad = test::good_request();
  bad.quadrotor.mass_kg = -1;
  writer->write([&](auto* sample) { to_wire(bad, sample); });
  ASSERT_TRUE(log.wait([&] { return !log.requests.empty(); }));
  EXPECT_NE(log.requests[0].second.find("mass_kg"), std::string::npos) << log.requests[0].second;

  bad = test::good_request("no/such name");
  writer->write([&](auto* sample) { to_wire(bad, sample); });
  ASSERT_TRUE(log.wait([&] { return !log.rejected.empty(); }));
  EXPECT_EQ(log.rejected[0].first, Topic::kSessionRequest);
  EXPECT_EQ(log.rejected[0].second.field, "vehicle");

  writer->write([&](auto* sample) { to_wire(test::good_request("drone", 8), sample); });
  ASSERT_TRUE(log.wait([&] { return log.requests.size() == 2; }));
  ASSERT_TRUE(server->publish(test::good_reply("drone", 8)).ok());
  auto states = must(Writer<wire::VehicleStatePubSubType>::open(participant.get(), Topic::kVehicleState));
  protocol::VehicleState skewed = test::good_state();
  skewed.state.v_WB.x() = 1e9;
  ASSERT_TRUE(send_until([&] { states->write([&](auto* sample) { to_wire(skewed, sample); }); },
                         [&](auto limit) { return log.wait([&] { return log.rejected.size() > 1; }, limit); }));
  EXPECT_EQ(log.rejected[1].second.code, ErrorCode::kInvalid);
  EXPECT_EQ(log.rejected[1].second.field, "v_WB");
}

// Asks for a session, as whoever wants to be heard must. It stays as long as what comes back.
auto join(Participant* participant, RecordingServer* log, ServerEndpoint* server, std::uint64_t number) {
  auto writer = must(Writer<wire::SessionRequestPubSubType>::open(participant, Topic::kSessionRequest));
  writer->write([&](auto* sample) { to_wire(test::good_request("drone", number), sample); });
  EXPECT_TRUE(log->wait([&] { return !log->requests.empty() && log->requests.back().first.request == number; }));
  EXPECT_TRUE(server->publish(test::good_reply("drone", number)).ok());
  return writer;
}

// Sends garbage on one topic, then good samples, which must still get through.
template <typename Generated, typename Message, typename Count>
void throw_garbage(RecordingServer* log, ServerEndpoint* server, Topic topic, const Message& good, Count&& count) {
  using namespace eprosima::fastdds::dds;
  auto stranger = must(Participant::open(own_domain(), "stranger", "", {}, [](const PeerEvent&) {}));
  auto session = join(stranger.get(), log, server, 100 + static_cast<std::uint64_t>(topic));
  auto* dds_topic = stranger->topic(topic_name(topic), TypeSupport(new RawType<Generated>()));
  auto* publisher = stranger->raw()->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto* raw = publisher->create_datawriter(dds_topic, writer_qos(topic, {}));
  ASSERT_NE(raw, nullptr);
  PublicationMatchedStatus matched;
  ASSERT_TRUE(send_until(
      [&] {
        std::this_thread::sleep_for(20ms);
        raw->get_publication_matched_status(matched);
      },
      [&](auto) { return matched.current_count > 0; }));
  std::this_thread::sleep_for(200ms);  // the reader may learn of the match a little later

  typename Generated::type key;
  key.vehicle() = "drone";
  Random random(3);
  const std::vector<std::vector<std::uint8_t>> hostile = {
      {},
      {0},
      {0, 1, 0, 0},
      {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff},
      {0, 1, 0, 0, 0xff, 0xff, 0xff, 0x7f},                              // a string of 2 GB
      {0, 1, 0, 0, 0, 0, 0, 0},                                          // a string without even its zero
      {0, 0, 0, 0, 0, 0, 0, 2, 'x', 0},                                  // big endian
      {0, 1, 0, 0, 6, 0, 0, 0, 'd', 'r', 'o', 'n', 'e', 0, 0, 0, 1, 2},  // cut short
  };
  const auto send = [&](const std::vector<std::uint8_t>& bytes) {
    RawType<Generated>::bytes = bytes;
    raw->write(&key);
    std::this_thread::sleep_for(5ms);
  };
  for (const auto& bytes : hostile) send(bytes);
  for (int i = 0; i < 60; ++i) {  // a good beginning, then noise
    std::vector<std::uint8_t> bytes = {0, 1, 0, 0, 6, 0, 0, 0, 'd', 'r', 'o', 'n', 'e', 0, 0, 0};
    const std::size_t length = 20 + random.below(700);
    while (bytes.size() < length) bytes.push_back(static_cast<std::uint8_t>(random.bits()));
    send(bytes);
  }
  publisher->delete_datawriter(raw);
  stranger->raw()->delete_publisher(publisher);

  auto honest = must(Participant::open(own_domain(), "honest", "", {}, [](const PeerEvent&) {}));
  auto its_session = join(honest.get(), log, server, 200 + static_cast<std::uint64_t>(topic));
  auto writer = must(Writer<Generated>::open(honest.get(), topic));
  const std::size_t before = count();
  EXPECT_TRUE(send_until(
      [&] {
        writer->write([&](typename Generated::type* sample) {
          if constexpr (std::is_same_v<Message, protocol::DepthFrame>) {
            header_to_wire(good, sample);
            sample->pixels() = good.pixels;
          } else {
            to_wire(good, sample);
          }
        });
      },
      [&](auto limit) { return log->wait([&] { return count() > before; }, limit); }))
      << topic_name(topic);
}

TEST(BadInput, GarbageNeitherCrashesNorBlocksATopic) {
  RecordingServer log;
  auto server = must(ServerEndpoint::create(own_domain(), "planner-1", &log));
  throw_garbage<wire::VehicleStatePubSubType>(&log, server.get(), Topic::kVehicleState, test::good_state(),
                                              [&] { return log.states.size(); });
  throw_garbage<wire::DepthFramePubSubType>(&log, server.get(), Topic::kDepthFrame, test::good_frame(),
                                            [&] { return log.frames.size(); });
  throw_garbage<wire::SessionRequestPubSubType>(&log, server.get(), Topic::kSessionRequest, test::good_request(),
                                                [&] { return log.requests.size(); });
  EXPECT_FALSE(log.rejected.empty());
}

}  // namespace
}  // namespace gatefield::dds

int main(int argc, char** argv) {
  if (const char* domain = std::getenv("GATEFIELD_TEST_CHILD_DOMAIN"))
    return gatefield::dds::child_that_joins(static_cast<std::uint32_t>(std::atoi(domain)));
  setenv("GATEFIELD_TEST_DOMAIN", std::to_string(gatefield::test::own_domain()).c_str(), 1);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
