// The table of attacks of docs/security.md: what somebody in the domain does to a vehicle that flies, without forging
// packets byte by byte (tests/integration/race/hostile_packets_test.cpp does that).

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/library_log.h"
#include "common/dds/record_convert.h"
#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/integration/dds/attacked_flight.h"
#include "tests/integration/dds/raw_type.h"

namespace gatefield::dds {
namespace {

using Attacks = AttackedFlight;

TEST_F(Attacks, NoneIsNeeded) {
  expect_unharmed(fly(victim_.get()));
  EXPECT_EQ(told(), "");
  EXPECT_EQ(packets_told(), "");
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

void say(Writer<wire::PilotRecordPubSubType>* records, const protocol::PilotRecord& record, const ParticipantId& to) {
  records->write([&](wire::PilotRecord* sample) {
    to_wire(record, sample);
    sample->to() = to.bytes;
  });
}

TEST_F(AttacksOnAPair, AStrangersWordThatItFliesTheVehicleIsDropped) {
  Stranger stranger("gatefield-server:planner-2:standby-of:another");
  auto records = stranger.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const ParticipantId server = stranger.server(kServer);
  const auto taken =
      record_of("victim", victim_->session().session, stranger.overheard(), protocol::PilotRecord::Kind::kTaken);
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { say(records.get(), taken, server); }));
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
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { say(records.get(), give, to); }));
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

TEST_F(Attacks, ForgedServerStatusesCostNewcomersAMoment) {
  std::vector<std::unique_ptr<Stranger>> liars;
  std::vector<std::unique_ptr<Writer<wire::ServerStatusPubSubType>>> writers;
  for (int i = 0; i < 6; ++i) {  // more than a server gives way to
    liars.push_back(std::make_unique<Stranger>());
    writers.push_back(liars.back()->writer<wire::ServerStatusPubSubType>(Topic::kServerStatus));
  }
  std::atomic<bool> stop{false};
  std::thread lies([&] {
    protocol::ServerStatus status = test::good_status("plenty");
    status.room_cores = protocol::kMaxRoom_cores;
    while (!stop) {
      for (const auto& writer : writers) writer->write([&](wire::ServerStatus* sample) { to_wire(status, sample); });
      std::this_thread::sleep_for(50ms);
    }
  });
  std::this_thread::sleep_for(500ms);
  auto newcomer = join("newcomer");  // fails the test when it can't
  EXPECT_EQ(newcomer->session().server, kServer);
  stop = true;
  lies.join();
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
