// The table of attacks of docs/security.md: what somebody in the domain does to a vehicle that flies, without forging
// packets byte by byte (tests/integration/race/hostile_packets_test.cpp does that).

#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/dds/convert.h"
#include "common/dds/library_log.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/record_convert.h"
#include "common/dds/server_endpoint.h"
#include "common/dds/writer.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "server/app/dds_transport.h"
#include "server/service/service.h"
#include "tests/integration/dds/raw_type.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;
using test::own_domain;

template <typename T>
T must(Result<T> result) {
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error());
  if (!result.ok()) std::abort();
  return std::move(result).value();
}

constexpr const char* kServer = "planner-1";

/// Somebody else in the domain, who overhears what is asked.
class Stranger {
 public:
  explicit Stranger(const std::string& user_data = {})
      : participant_(must(Participant::open(own_domain(), "stranger", user_data, {},
                                            [this](const PeerEvent& event) { meet(event); }))) {
    Reader<wire::SessionRequestPubSubType>::Callbacks callbacks;
    callbacks.sample = [this](wire::SessionRequest* request, const Origin&) { overheard_ = request->request(); };
    callbacks.unreadable = [] {};
    requests_ = must(
        Reader<wire::SessionRequestPubSubType>::open(participant_.get(), Topic::kSessionRequest, std::move(callbacks)));
  }
  /// The number of the newest request in the domain.
  std::uint64_t overheard() const {
    for (int i = 0; i < 500 && overheard_ == 0; ++i) std::this_thread::sleep_for(10ms);
    return overheard_;
  }
  Participant* participant() { return participant_.get(); }
  /// The participant of the server of this name.
  ParticipantId server(const std::string& name) {
    for (int i = 0; i < 500; ++i) {
      {
        const std::lock_guard lock(mutex_);
        for (const auto& [announced, id] : met_)
          if (announced.starts_with("gatefield-server:" + name + ":")) return id;
      }
      std::this_thread::sleep_for(10ms);
    }
    ADD_FAILURE() << "no server " << name;
    return {};
  }

  template <typename Generated>
  std::unique_ptr<Writer<Generated>> writer(Topic topic, std::uint32_t strength = 0,
                                            const std::string& partition = {}) {
    auto qos = writer_qos(topic, {});
    if (topic == Topic::kCommand) qos.ownership_strength().value = strength;
    return must(Writer<Generated>::open(participant_.get(), topic_name(topic), qos, partition));
  }

 private:
  void meet(const PeerEvent& event) {
    const std::lock_guard lock(mutex_);
    met_[event.user_data] = event.peer;
  }

  std::mutex mutex_;
  std::map<std::string, ParticipantId> met_;  // by what they announce
  std::unique_ptr<Participant> participant_;
  std::atomic<std::uint64_t> overheard_{0};
  std::unique_ptr<Reader<wire::SessionRequestPubSubType>> requests_;
};

/// A server as the program has it, with stand-ins for planner and sensor, and the victim, which joined it.
class Attacks : public ::testing::Test {
 protected:
  void SetUp() override {
    service::ServiceOptions options;
    options.name = kServer;
    options.max_vehicles = 4;
    options.profiles = {{"race", service::testing::small_profile()}};
    options.has_heir = !partners().heir.empty();
    service_ = std::make_unique<service::Service>(options, service::testing::fake_factories(), &clock_, &transport_);
    transport_.attach(service_.get());
    TransportOptions told;
    told.on_samples_dropped = [this](const DroppedSamples& dropped) {
      const std::lock_guard lock(mutex_);
      dropped_ += dropped.count;
      newest_ = dropped;
    };
    endpoint_ = must(ServerEndpoint::create(own_domain(), kServer, &transport_, told, partners()));
    transport_.attach(endpoint_.get());
    service_->start();
    victim_ = join("victim");
  }
  void TearDown() override {
    victim_.reset();
    service_->stop();
    endpoint_.reset();
  }

  virtual PartnerNames partners() const { return {}; }

  static std::unique_ptr<sdk::Client> join(const std::string& vehicle) {
    sdk::Options options;
    options.domain = own_domain();
    options.vehicle = vehicle;
    options.course = test::good_request().course;
    options.connect_timeout = 10s;
    return must(sdk::Client::connect(options));
  }

  struct Flown {
    int commands = 0;   ///< of the session that it flew with before
    int strange = 0;    ///< of any other, or with a stranger's mark
    bool kept = false;  ///< it has that session still
  };
  /// Flies for 1.2 s, while `attack` is called with the number of each state.
  Flown fly(sdk::Client* client, const std::function<void(std::uint64_t)>& attack = {}) {
    Flown flown;
    const std::uint64_t session = client->session().session;
    const Stamp end = clock_.now() + 1200ms;
    while (clock_.now() < end) {
      QuadrotorState state = test::good_state().state;
      state.p_WB = {0.0, 0.0, 1.5};
      state.v_WB.setZero();
      state.w_WB_B.setZero();
      state.q_WB.setIdentity();
      const std::uint64_t sequence = client->send_state(clock_.now(), state);
      if (attack) attack(sequence);
      std::this_thread::sleep_for(15ms);
      while (const auto command = client->newest()) {
        const bool strange = command->session != session || command->plan_step == kMark;
        ++(strange ? flown.strange : flown.commands);
      }
    }
    flown.kept = client->session().session == session;
    return flown;
  }
  /// The vehicle went on as if nobody else were there.
  static void expect_unharmed(const Flown& flown) {
    EXPECT_GT(flown.commands, 10);
    EXPECT_EQ(flown.strange, 0);
    EXPECT_TRUE(flown.kept);
  }
  std::string told() {
    const std::lock_guard lock(mutex_);
    return dropped_ > 0 ? in_words(newest_) : "";
  }

  static constexpr Stamp kMark = 123'456us;  ///< of a stranger's plan
  MonotonicClock clock_;
  app::DdsTransport transport_;
  std::unique_ptr<service::Service> service_;
  std::unique_ptr<ServerEndpoint> endpoint_;
  std::unique_ptr<sdk::Client> victim_;
  std::mutex mutex_;
  std::uint64_t dropped_ = 0;
  DroppedSamples newest_;
};

TEST_F(Attacks, NoneIsNeeded) {
  expect_unharmed(fly(victim_.get()));
  EXPECT_EQ(told(), "");
}

TEST_F(Attacks, AForgedReplyTakesNoVehicleOver) {
  Stranger stranger;
  auto replies = stranger.writer<wire::SessionReplyPubSubType>(Topic::kSessionReply);
  const std::uint64_t number = stranger.overheard();
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::SessionReply reply = test::good_reply("victim", number);
    reply.server = kServer;
    reply.session = 666;
    if (sequence % 2 == 0) {  // or sends it away
      reply.accepted = false;
      reply.reason = "the server is leaving";
      reply.code = ErrorCode::kLeaving;
    }
    replies->write([&](auto* sample) { to_wire(reply, sample); });
  }));
}

TEST_F(Attacks, ForgedCommandsOfAnyStrengthAreNotFlown) {
  Stranger stranger;
  auto commands =
      stranger.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  const std::uint64_t session = victim_->session().session;
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::ThrustRateCommand command = test::good_command("victim", 1000 + sequence);
    command.session = session;
    command.plan_step = kMark;
    commands->write([&](auto* sample) { to_wire(command, sample); });
  }));
  EXPECT_GT(victim_->statistics().rejected, 10u) << "strangers' are counted";
}

TEST_F(Attacks, ForgedStatesAndDepthAreDropped) {
  Stranger stranger;
  auto states = stranger.writer<wire::VehicleStatePubSubType>(Topic::kVehicleState);
  auto frames = stranger.writer<wire::DepthFramePubSubType>(Topic::kDepthFrame);
  const std::uint64_t session = victim_->session().session;
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::VehicleState state = test::good_state("victim", sequence + 1);
    state.session = session;
    state.stamp = clock_.now();
    states->write([&](auto* sample) { to_wire(state, sample); });
    protocol::DepthFrame frame = test::good_frame("victim", sequence);
    frame.session = session;
    frames->write([&](auto* sample) {
      header_to_wire(frame, sample);
      sample->pixels() = frame.pixels;
    });
  }));
  EXPECT_NE(told().find("for \"victim\" from participant"), std::string::npos) << told();
  protocol::Telemetry telemetry;
  service_->session_of("victim")->fill(clock_.now(), &telemetry);
  EXPECT_EQ(telemetry.states_rejected, 0u) << telemetry.last_reason;
  EXPECT_EQ(telemetry.frames_received, 0u);
  EXPECT_EQ(telemetry.health.problems & protocol::bit(protocol::Problem::kStampsJump), 0u);
}

TEST_F(Attacks, AForgedGoodbyeEndsNoSession) {
  Stranger stranger;
  auto requests = stranger.writer<wire::SessionRequestPubSubType>(Topic::kSessionRequest);
  protocol::SessionRequest request = test::good_request("victim", stranger.overheard());
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    // A goodbye, then what a server has to refuse: the refusal would carry the victim's number.
    request.action = protocol::SessionRequest::Action::kLeave;
    request.profile = "race";
    if (sequence % 2 == 0) {
      request.action = protocol::SessionRequest::Action::kJoin;
      request.profile = "none-of-that-name";
    }
    if (sequence % 5 == 0) requests->write([&](auto* sample) { to_wire(request, sample); });
  }));
  requests->withdraw("victim");
  requests.reset();
  expect_unharmed(fly(victim_.get()));
}

TEST_F(Attacks, AServersNameKeepsNoServerFromStarting) {
  const Stranger stranger(std::string("gatefield-server:") + "planner-2" + ":serving");
  std::this_thread::sleep_for(300ms);
  struct : ServerHandler {
    void on_session_request(const protocol::SessionRequest&, const Status&) override {}
    void on_state(const protocol::VehicleState&) override {}
    void on_depth(protocol::DepthFrame&) override {}
    void on_vehicle_gone(const std::string&, std::uint64_t) override {}
    void on_rejected(Topic, const std::string&, const Error&) override {}
    void on_namesake(const ParticipantId&) override { namesakes.fetch_add(1); }
    std::atomic<int> namesakes{0};
  } handler;
  const auto server = ServerEndpoint::create(own_domain(), "planner-2", &handler);
  EXPECT_TRUE(server.ok()) << server.error();
  for (int i = 0; i < 500 && handler.namesakes == 0; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(handler.namesakes, 1) << "it is told";
}

TEST_F(Attacks, WhoSaysThatItStandsByIsNobodysHeir) {
  Stranger stranger(std::string("gatefield-server:evil:standby-of:") + kServer);
  auto commands =
      stranger.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  auto replies = stranger.writer<wire::SessionReplyPubSubType>(Topic::kSessionReply);
  const std::uint64_t session = victim_->session().session;
  const std::uint64_t number = stranger.overheard();
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::SessionReply reply = test::good_reply("victim", number);
    reply.session = session;
    reply.server = "evil";
    if (sequence % 10 == 0) replies->write([&](auto* sample) { to_wire(reply, sample); });
    protocol::ThrustRateCommand command = test::good_command("victim", 1000 + sequence);
    command.session = session;
    command.plan_step = kMark;
    commands->write([&](auto* sample) { to_wire(command, sample); });
  }));
  EXPECT_EQ(victim_->session().heir, protocol::ParticipantBytes());
}

/// The server was told of a stand-by, which is not there.
class AttacksOnAPair : public Attacks {
  PartnerNames partners() const override { return {.heir = "planner-2"}; }
};

protocol::PilotRecord record_of(const std::string& vehicle, std::uint64_t session, std::uint64_t request,
                                protocol::PilotRecord::Kind kind) {
  protocol::PilotRecord record;
  record.vehicle = vehicle;
  record.session = session;
  record.request = request;
  record.kind = kind;
  if (kind <= protocol::PilotRecord::Kind::kHandOver) record.pilot = {1, 2, 3};
  return record;
}

TEST_F(AttacksOnAPair, AStrangersWordThatItFliesTheVehicleIsDropped) {
  Stranger stranger("gatefield-server:planner-2:standby-of:another");
  auto records = stranger.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const ParticipantId server = stranger.server(kServer);
  const auto taken =
      record_of("victim", victim_->session().session, stranger.overheard(), protocol::PilotRecord::Kind::kTaken);
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) {
    records->write([&](wire::PilotRecord* sample) {
      to_wire(taken, sample);
      sample->to() = server.bytes;
    });
  }));
  EXPECT_NE(service_->session_of("victim"), nullptr);
  EXPECT_NE(told().find("gatefield/server/pilot"), std::string::npos) << told();
}

TEST_F(Attacks, AStrangersRecordsAreNotFollowed) {
  struct : ServerHandler {
    void on_session_request(const protocol::SessionRequest&, const Status&) override {}
    void on_state(const protocol::VehicleState&) override {}
    void on_depth(protocol::DepthFrame&) override {}
    void on_vehicle_gone(const std::string&, std::uint64_t) override {}
    void on_rejected(Topic, const std::string&, const Error&) override {}
    void on_leader(const std::optional<ParticipantId>& leader, bool) override { leaders.fetch_add(leader ? 1 : 0); }
    void on_record(const protocol::PilotRecord&) override { heard.fetch_add(1); }
    void on_leader_command(const protocol::ThrustRateCommand&) override { commands.fetch_add(1); }
    std::atomic<int> leaders{0}, heard{0}, commands{0};
  } handler;
  std::atomic<std::uint64_t> dropped{0};
  TransportOptions options;
  options.on_samples_dropped = [&](const DroppedSamples& told) { dropped += told.count; };
  const auto stand_by = must(ServerEndpoint::create(own_domain(), "planner-2", &handler, options, {.leader = kServer}));
  for (int i = 0; i < 500 && handler.leaders == 0; ++i) std::this_thread::sleep_for(10ms);
  ASSERT_EQ(handler.leaders, 1);
  // Second of its leader's name: the first one is the leader.
  Stranger stranger(std::string("gatefield-server:") + kServer + ":serving");
  auto records = stranger.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const ParticipantId to = stranger.server("planner-2");
  const auto give =
      record_of("victim", victim_->session().session, stranger.overheard(), protocol::PilotRecord::Kind::kHandOver);
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) {
    records->write([&](wire::PilotRecord* sample) {
      to_wire(give, sample);
      sample->to() = to.bytes;
    });
  }));
  EXPECT_EQ(handler.heard, 0);
  EXPECT_GT(dropped, 0u);
  EXPECT_GT(handler.commands, 10) << "the leader's commands are heard";
}

TEST_F(Attacks, RequestsUnderManyNamesLeaveRoomForNewcomers) {
  Stranger stranger;
  auto requests = stranger.writer<wire::SessionRequestPubSubType>(Topic::kSessionRequest);
  for (std::uint64_t i = 0; i < 400; ++i) {
    protocol::SessionRequest request = test::good_request("crowd-" + std::to_string(i), i + 1);
    request.profile = "none-of-that-name";  // refused: what takes places is the asking
    requests->write([&](auto* sample) { to_wire(request, sample); });
    if (i % 20 == 0) std::this_thread::sleep_for(10ms);
  }
  const auto newcomer = join("newcomer");
  expect_unharmed(fly(newcomer.get()));
  EXPECT_NE(told().find("gatefield/session/request"), std::string::npos) << told();
}

TEST_F(Attacks, StatesUnderManyNamesLeaveRoomForNewcomers) {
  Stranger stranger;
  // A writer has a limit of names itself, and what one has said is alive as long as it is there.
  std::vector<std::unique_ptr<Writer<wire::VehicleStatePubSubType>>> writers;
  for (int crowd = 0; crowd < 20; ++crowd) {
    writers.push_back(stranger.writer<wire::VehicleStatePubSubType>(Topic::kVehicleState));
    const auto& states = writers.back();
    std::this_thread::sleep_for(50ms);
    for (std::uint64_t i = 0; i < 250; ++i) {
      const std::string name = "crowd-" + std::to_string(crowd) + "-" + std::to_string(i);
      states->write([&](auto* sample) { to_wire(test::good_state(name, i + 1), sample); });
    }
  }
  const auto newcomer = join("newcomer");
  expect_unharmed(fly(newcomer.get()));
  EXPECT_NE(told().find("gatefield/vehicle/state"), std::string::npos) << told();
}

TEST_F(Attacks, SamplesTooLargeFillNoLog) {
  std::atomic<int> lines{0};
  set_library_log([&](const std::string&) { ++lines; });
  using namespace eprosima::fastdds::dds;
  using Raw = RawType<wire::VehicleStatePubSubType>;
  Stranger stranger;
  auto* const topic = stranger.participant()->topic(topic_name(Topic::kVehicleState), TypeSupport(new Raw()));
  auto* const publisher = stranger.participant()->raw()->create_publisher(PUBLISHER_QOS_DEFAULT);
  DataWriterQos qos = writer_qos(Topic::kVehicleState, {});
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  auto* const writer = publisher->create_datawriter(topic, qos);
  ASSERT_NE(writer, nullptr);
  Raw::bytes = {0, 1, 0, 0, 7, 0, 0, 0, 'v', 'i', 'c', 't', 'i', 'm', 0, 0};
  Raw::bytes.resize(1300);
  wire::VehicleState key;
  key.vehicle() = "victim";
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) {
    for (int i = 0; i < 50; ++i) writer->write(&key);
  }));
  publisher->delete_datawriter(writer);
  stranger.participant()->raw()->delete_publisher(publisher);
  EXPECT_LE(lines, 4) << "a line a second";
  set_library_log({});
}

}  // namespace
}  // namespace gatefield::dds
