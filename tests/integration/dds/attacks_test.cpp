// The table of attacks of docs/security.md: what somebody in the domain does to a vehicle that flies, mostly without
// forging packets byte by byte (tests/integration/race/hostile_packets_test.cpp does that).

#include <atomic>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/dds/library_log.h"
#include "tests/integration/dds/attacked_flight.h"
#include "tests/integration/dds/forged_packet.h"
#include "tests/integration/dds/other_server.h"
#include "tests/integration/dds/oversized_states.h"

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
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) { say(commands.get(), session, sequence); }));
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
  EXPECT_NE(told_of(Topic::kSessionRequest).find("for \"victim\" from participant"), std::string::npos) << told();
  requests->withdraw("victim");
  requests.reset();
  expect_unharmed(fly(victim_.get()));
}

TEST_F(Attacks, AServersNameKeepsNoServerFromStarting) {
  const Stranger stranger(std::string("gatefield-server:") + "planner-2" + ":serving");
  std::this_thread::sleep_for(300ms);
  OtherServer handler;
  const auto server = ServerEndpoint::create(own_domain(), "planner-2", &handler);
  EXPECT_TRUE(server.ok()) << server.error();
  EXPECT_TRUE(within_5s([&] { return handler.namesakes == 1; })) << "it is told";
  // And the name of one that serves keeps nobody from it.
  const Stranger namesake(std::string("gatefield-server:") + kServer + ":serving");
  const auto newcomer = join("newcomer");
  expect_unharmed(fly(newcomer.get()));
  expect_unharmed(fly(victim_.get()));
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
    say(commands.get(), session, sequence);
  }));
  EXPECT_EQ(victim_->session().heir, protocol::ParticipantBytes());
}

/// The server was told of a stand-by, which is not there.
class AttacksOnAPair : public Attacks {
  PartnerNames partners() const override { return {.heir = "planner-2"}; }
};

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
  OtherServer handler;
  std::atomic<std::uint64_t> dropped{0};
  TransportOptions options;
  options.on_samples_dropped = [&](const DroppedSamples& told) { dropped += told.count; };
  const auto stand_by = must(ServerEndpoint::create(own_domain(), "planner-2", &handler, options, {.leader = kServer}));
  ASSERT_TRUE(within_5s([&] { return handler.leaders == 1; }));
  // Second of its leader's name: the first one is the leader.
  Stranger stranger(std::string("gatefield-server:") + kServer + ":serving");
  auto records = stranger.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const ParticipantId to = stranger.server("planner-2");
  const auto give =
      record_of("victim", victim_->session().session, stranger.overheard(), protocol::PilotRecord::Kind::kHandOver);
  const auto commands =
      stranger.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  const std::uint64_t session = victim_->session().session;
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    say(records.get(), give, to);
    say(commands.get(), session, sequence);
  }));
  EXPECT_EQ(handler.records, 0);
  EXPECT_EQ(handler.forged_commands, 0);
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

// Not an attack that is held off: what an open domain is.
TEST_F(Attacks, EverybodyReadsTheVictimsCommands) {
  Stranger stranger;
  std::atomic<int> heard{0};
  Reader<wire::ThrustRateCommandPubSubType>::Callbacks hears;
  hears.sample = [&](wire::ThrustRateCommand*, const Origin&) { ++heard; };
  hears.unreadable = [] {};
  const auto listens = must(Reader<wire::ThrustRateCommandPubSubType>::open(stranger.participant(), Topic::kCommand,
                                                                            hears, command_partition("victim")));
  for (int i = 0; i < 5 && heard == 0; ++i) expect_unharmed(fly(victim_.get()));
  EXPECT_GT(heard, 0);
}

// Nor this one: the server takes it for the participant's own state, and drops it only because that has no session.
TEST_F(Attacks, PlainPacketsAreTakenForTheirNames) {
  using namespace eprosima::fastdds::dds;
  Stranger stranger;
  auto* const topic = stranger.participant()->topic(topic_name(Topic::kVehicleState),
                                                    TypeSupport(new WireType<wire::VehicleStatePubSubType>()));
  auto* const publisher = stranger.participant()->raw()->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto* const writer = publisher->create_datawriter(topic, writer_qos(Topic::kVehicleState, {}));
  ASSERT_NE(writer, nullptr);
  PublicationMatchedStatus matched;
  ASSERT_TRUE(within_5s([&] {
    writer->get_publication_matched_status(matched);
    return matched.current_count == 1;
  }));
  const PacketBytes packet = plain_state(writer->guid(), test::good_state("rival", 1));
  ASSERT_FALSE(packet.empty());
  EXPECT_TRUE(within_5s([&] {
    send_to_all(packet);
    return told_of(Topic::kVehicleState).find("for \"rival\"") != std::string::npos;
  })) << packets_told();
  publisher->delete_datawriter(writer);
  stranger.participant()->raw()->delete_publisher(publisher);
}

/// A participant of the library's own, without our guard: what it believes of others.
class Bystander : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  Bystander()
      : participant_(eprosima::fastdds::dds::DomainParticipantFactory::get_instance()->create_participant(
            own_domain(), eprosima::fastdds::dds::PARTICIPANT_QOS_DEFAULT, this)) {}
  ~Bystander() override {
    eprosima::fastdds::dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  bool met(const ParticipantId& who) { return has(met_, who); }
  bool missed(const ParticipantId& who) { return has(missed_, who); }

 private:
  using Participants = std::set<ParticipantId>;
  bool has(const Participants& of, const ParticipantId& who) {
    const std::lock_guard lock(mutex_);
    return of.contains(who);
  }
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override {
    using Info = eprosima::fastrtps::rtps::ParticipantDiscoveryInfo;
    const std::lock_guard lock(mutex_);
    const bool gone = info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT;
    (gone ? missed_ : met_).insert(id_of(info.info.m_guid.guidPrefix));
  }
  std::mutex mutex_;
  Participants met_, missed_;
  eprosima::fastdds::dds::DomainParticipant* const participant_;
};

TEST_F(Attacks, AForgedGoodbyeOfAParticipantIsLeftOut) {
  Stranger stranger;
  const ParticipantId server = stranger.server(kServer);
  ParticipantId victim;
  ASSERT_TRUE(within_5s([&] {
    for (const auto& [announced, id] : stranger.met())
      if (Pairing::server_in(announced).empty()) victim = id;
    return victim != ParticipantId();
  }));
  Bystander bystander;
  ASSERT_TRUE(within_5s([&] { return bystander.met(victim) && bystander.met(server); }));
  std::int64_t sequence = 1000;
  const auto say_goodbye = [&] {
    ++sequence;
    for (const ParticipantId& one : {victim, server})
      if (!bystander.missed(one)) send_to_all(goodbye_of(one, sequence));
  };
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { say_goodbye(); }));
  EXPECT_TRUE(within_5s([&] {
    say_goodbye();
    return bystander.missed(victim) && bystander.missed(server);
  })) << "the library alone believes it";
}

TEST_F(Attacks, SamplesTooLargeFillNoLog) {
  std::atomic<int> lines{0};
  set_library_log([&](const std::string&) { ++lines; });
  Stranger stranger;
  {
    const OversizedStates states(stranger.participant(), "victim");
    expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { states.write(50); }));
  }
  EXPECT_LE(lines, 4) << "a line a second";
  set_library_log({});
}

}  // namespace
}  // namespace gatefield::dds
