// The column "with security" of docs/security.md: strangers without a certificate or with one of others, and members
// who want more than they may.

#include <cstdlib>
#include <filesystem>

#include "gatefield_idl/serversPubSubTypes.h"
#include "tests/integration/dds/forged_packet.h"
#include "tests/integration/dds/secured_flight.h"

namespace gatefield::dds {
namespace {

namespace fs = std::filesystem;

class SecuredAttacks : public SecuredFlight {
 protected:
  /// The stranger says everything that one says in a domain, of and to the victim, and listens, as far as his own
  /// library lets him: nobody takes anything from him, and he hears nobody else.
  void expect_shut_out(Stranger* stranger) {
    const ParticipantId own = id_of(stranger->participant()->raw()->guid().guidPrefix);
    std::atomic<int> heard{0};
    Reader<wire::ThrustRateCommandPubSubType>::Callbacks hears;
    hears.sample = [&](wire::ThrustRateCommand*, const Origin& origin) { heard += origin.participant == own ? 0 : 1; };
    hears.unreadable = [&] { ++heard; };
    const auto listens = Reader<wire::ThrustRateCommandPubSubType>::open(stranger->participant(), Topic::kCommand,
                                                                         hears, command_partition("victim"));
    const auto requests = Writer<wire::SessionRequestPubSubType>::open(stranger->participant(), Topic::kSessionRequest);
    const auto states = Writer<wire::VehicleStatePubSubType>::open(stranger->participant(), Topic::kVehicleState);
    const auto frames = Writer<wire::DepthFramePubSubType>::open(stranger->participant(), Topic::kDepthFrame);
    const auto replies = Writer<wire::SessionReplyPubSubType>::open(stranger->participant(), Topic::kSessionReply);
    const auto statuses = Writer<wire::ServerStatusPubSubType>::open(stranger->participant(), Topic::kServerStatus);
    const auto commands = Writer<wire::ThrustRateCommandPubSubType>::open(stranger->participant(), Topic::kCommand,
                                                                          command_partition("victim"));
    const std::uint64_t session = victim_->session().session;
    const std::uint64_t number = service_->session_of("victim")->request().request;
    expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
      protocol::SessionRequest goodbye = test::good_request("victim", number);
      goodbye.action = protocol::SessionRequest::Action::kLeave;
      if (requests.ok()) (*requests)->write([&](auto* sample) { to_wire(goodbye, sample); });
      protocol::VehicleState state = test::good_state("victim", sequence + 1);
      state.session = session;
      if (states.ok()) (*states)->write([&](auto* sample) { to_wire(state, sample); });
      protocol::DepthFrame frame = test::good_frame("victim", sequence);
      frame.session = session;
      if (frames.ok())
        (*frames)->write([&](auto* sample) {
          header_to_wire(frame, sample);
          sample->pixels() = frame.pixels;
        });
      protocol::SessionReply reply = test::good_reply("victim", number);
      reply.accepted = sequence % 2 == 0;
      reply.reason = "the server is leaving";
      if (replies.ok()) (*replies)->write([&](auto* sample) { to_wire(reply, sample); });
      if (statuses.ok())
        (*statuses)->write([&](wire::ServerStatus* sample) { to_wire(test::good_status("plenty"), sample); });
      protocol::ThrustRateCommand command = test::good_command("victim", 1000 + sequence);
      command.session = session;
      command.plan_step = kMark;
      if (commands.ok()) (*commands)->write([&](auto* sample) { to_wire(command, sample); });
    }));
    EXPECT_TRUE(listens.ok() || commands.ok()) << "he tried nothing";
    if (states.ok()) {
      EXPECT_EQ((*states)->readers(), 0u);
    }
    if (replies.ok()) {
      EXPECT_EQ((*replies)->readers(), 0u);
    }
    EXPECT_EQ(heard, 0);
    EXPECT_EQ(told(), "") << "nothing of his came as far as the server's own checks";
    EXPECT_EQ(victim_->statistics().rejected, 0u);
  }
};

TEST_F(SecuredAttacks, NoneIsNeeded) {
  expect_unharmed(fly(victim_.get()));
  const auto rival = join(std::string(protocol::kMaxNameLength, 'r'));  // its handshake is the longest
  expect_unharmed(fly(rival.get()));
  EXPECT_EQ(told(), "");
  EXPECT_EQ(packets_told(), "") << "an honest packet was dropped";
  EXPECT_EQ(victim_->statistics().packets_dropped, 0u);
}

TEST_F(SecuredAttacks, NobodyWithoutACertificateTakesPart) {
  Stranger stranger;
  expect_shut_out(&stranger);
}

TEST_F(SecuredAttacks, ACertificateOfAnotherAuthorityIsNone) {
  const Credentials server = credentials_of(other_keys(), Role::kServer, kServer);
  Stranger commander({}, &server);
  expect_shut_out(&commander);
  const Credentials vehicle = credentials_of(other_keys(), Role::kVehicle, "victim");
  Stranger listener({}, &vehicle);
  expect_shut_out(&listener);
}

// The vehicle signs its own rights, a server's: with its own key, and with the authority of identities, were they one.
TEST_F(SecuredAttacks, RightsThatOthersSignedAreNone) {
  const fs::path folder = keys().folder() / "self-made";
  fs::copy(keys().make("vehicle", "rival"), folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  fs::copy_file(folder / "identity-ca.pem", folder / "permissions-ca.pem", fs::copy_options::overwrite_existing);
  const std::string sign =
      "set -e; cd " + folder.string() +
      "; for file in governance permissions; do openssl smime "
      "-verify -noverify -text -in $file.p7s -out $file.xml 2>/dev/null; sed -i 's/<subscribe>/"
      "<publish><topics><topic>gatefield\\/*<\\/topic><\\/topics><partitions><partition>*<\\/"
      "partition><\\/partitions><\\/publish><subscribe>/' $file.xml; openssl smime -sign -text -md "
      "sha256 -in $file.xml -out $file.p7s -signer " +
      (keys().authority() / "identity-ca.pem").string() + " -inkey " +
      (keys().authority() / "identity-ca.key").string() + "; done";
  ASSERT_EQ(std::system(sign.c_str()), 0);
  const auto refused = read_credentials(folder, {Role::kVehicle, "rival"});
  ASSERT_FALSE(refused.ok()) << "our own programs don't take it either";
  Credentials files = credentials_of(keys(), Role::kVehicle, "rival");
  files.permissions_authority = folder / "permissions-ca.pem";
  files.governance = folder / "governance.p7s";
  files.permissions = folder / "permissions.p7s";
  files.identity.role = Role::kVehicle;
  Stranger stranger({}, &files);
  const auto commands =
      stranger.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  const auto states = stranger.writer<wire::VehicleStatePubSubType>(Topic::kVehicleState);
  expect_unharmed(fly(victim_.get()));
  EXPECT_EQ(commands->readers() + states->readers(), 0u);
}

TEST_F(SecuredAttacks, ARevokedCertificateIsNone) {
  const fs::path kept = keys().folder() / "stolen";
  fs::copy(keys().make("vehicle", "thief"), kept, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  const Credentials stolen = must(read_credentials(kept, {Role::kVehicle, "thief"}));
  keys().must({"revoke", "thief"});
  TearDown();  // a server reads the list when it starts
  SetUp();
  sdk::Options options = options_of("victim");
  options.vehicle = "thief";
  options.network.security = kept.string();
  options.connect_timeout = 2s;
  const auto joined = sdk::Client::connect(options);
  ASSERT_FALSE(joined.ok());
  EXPECT_EQ(joined.failure().code, ErrorCode::kNoAnswer) << joined.error();
  expect_unharmed(fly(victim_.get()));
}

TEST_F(SecuredAttacks, ACertificateThatExpiredIsNone) {
  const fs::path folder = keys().folder() / "expired";
  fs::copy(keys().make("vehicle", "rival"), folder, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  const Credentials good = credentials_of(keys(), Role::kVehicle, "rival");
  const std::string authority = keys().authority().string();
  const std::string again = "cd " + folder.string() + " && export GATEFIELD_AUTHORITY=" + authority +
                            " && openssl req -new -key key.pem -out request -config " + authority +
                            "/openssl.cnf -subj /O=Gatefield/OU=vehicle/CN=rival 2>/dev/null && openssl ca -batch "
                            "-notext -config " +
                            authority +
                            "/openssl.cnf -in request -out certificate.pem -startdate 20200101000000Z "
                            "-enddate 20210101000000Z 2>/dev/null";
  ASSERT_EQ(std::system(again.c_str()), 0);
  Credentials expired = good;  // as a program of somebody else would take them
  expired.certificate = folder / "certificate.pem";
  expired.key = folder / "key.pem";
  const auto opened = Participant::open(
      own_domain(), "stranger", {}, {}, [](const PeerEvent&) {}, {}, {}, &expired);
  if (!opened.ok()) return;  // his own library doesn't take them either
  const auto states = Writer<wire::VehicleStatePubSubType>::open((*opened).get(), Topic::kVehicleState);
  expect_unharmed(fly(victim_.get()));
  ASSERT_TRUE(states.ok()) << states.error();
  EXPECT_EQ((*states)->readers(), 0u);
}

// A member says its own things, and another vehicle's.
TEST_F(SecuredAttacks, AVehicleSpeaksForNoOtherOne) {
  const Credentials own = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger rival({}, &own);
  auto requests = rival.writer<wire::SessionRequestPubSubType>(Topic::kSessionRequest);
  auto states = rival.writer<wire::VehicleStatePubSubType>(Topic::kVehicleState);
  auto frames = rival.writer<wire::DepthFramePubSubType>(Topic::kDepthFrame);
  for (int i = 0; i < 500 && states->readers() * requests->readers() * frames->readers() == 0; ++i)
    std::this_thread::sleep_for(10ms);
  ASSERT_GT(states->readers() * requests->readers() * frames->readers(), 0u) << "what is its own is heard";
  const std::uint64_t session = victim_->session().session;
  protocol::SessionRequest request = test::good_request("victim", service_->session_of("victim")->request().request);
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    request.action =
        sequence % 2 == 0 ? protocol::SessionRequest::Action::kLeave : protocol::SessionRequest::Action::kJoin;
    if (sequence % 5 == 0) requests->write([&](auto* sample) { to_wire(request, sample); });
  }));
  EXPECT_NE(told_of(Topic::kSessionRequest).find("certificate is another vehicle's"), std::string::npos) << told();
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::VehicleState state = test::good_state("victim", sequence + 1);
    state.session = session;
    states->write([&](auto* sample) { to_wire(state, sample); });
  }));
  EXPECT_NE(told_of(Topic::kVehicleState).find("for \"victim\""), std::string::npos) << told();
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    protocol::DepthFrame frame = test::good_frame("victim", sequence);
    frame.session = session;
    frames->write([&](auto* sample) {
      header_to_wire(frame, sample);
      sample->pixels() = frame.pixels;
    });
  }));
  EXPECT_NE(told_of(Topic::kDepthFrame).find("for \"victim\""), std::string::npos) << told();
  protocol::Telemetry telemetry;
  service_->session_of("victim")->fill(clock_.now(), &telemetry);
  EXPECT_EQ(telemetry.states_rejected, 0u) << telemetry.last_reason;
  EXPECT_EQ(telemetry.frames_received, 0u);
}

TEST_F(SecuredAttacks, AVehicleCommandsNobody) {
  const Credentials own = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger rival({}, &own);
  for (const std::string partition : {"gatefield/victim", "gatefield/rival"})
    EXPECT_FALSE(Writer<wire::ThrustRateCommandPubSubType>::open(rival.participant(), Topic::kCommand, partition).ok());
  EXPECT_FALSE(Writer<wire::SessionReplyPubSubType>::open(rival.participant(), Topic::kSessionReply).ok());
  EXPECT_FALSE(Writer<wire::TelemetryPubSubType>::open(rival.participant(), Topic::kTelemetry).ok());
  EXPECT_FALSE(Writer<wire::ServerStatusPubSubType>::open(rival.participant(), Topic::kServerStatus).ok());
  EXPECT_FALSE(Writer<wire::PilotRecordPubSubType>::open(rival.participant(), Topic::kPilotRecord).ok());
}

// Its own library would hold it to its rights; so it asks for its own commands, which it may, and then for another's.
TEST_F(SecuredAttacks, AVehicleReadsNoOtherOnesCommands) {
  const Credentials own = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger rival({}, &own);
  using CommandReader = Reader<wire::ThrustRateCommandPubSubType>;
  std::atomic<int> heard{0};
  CommandReader::Callbacks hears;
  hears.sample = [&](wire::ThrustRateCommand*, const Origin&) { ++heard; };
  hears.unreadable = [&] { ++heard; };
  for (const std::string partition : {"gatefield/victim", "gatefield/*", "*", ""})
    EXPECT_FALSE(CommandReader::open(rival.participant(), Topic::kCommand, hears, partition).ok()) << partition;
  EXPECT_FALSE(Reader<wire::VehicleStatePubSubType>::open(rival.participant(), Topic::kVehicleState,
                                                          {[](auto*, const Origin&) {}, nullptr, [] {}})
                   .ok());

  using namespace eprosima::fastdds::dds;
  auto* const topic = rival.participant()->topic(topic_name(Topic::kCommand),
                                                 TypeSupport(new WireType<wire::ThrustRateCommandPubSubType>()));
  SubscriberQos partitioned = SUBSCRIBER_QOS_DEFAULT;
  partitioned.partition().push_back("gatefield/rival");
  auto* const subscriber = rival.participant()->raw()->create_subscriber(partitioned);
  auto* const reader = subscriber->create_datareader(topic, reader_qos(Topic::kCommand, {}));
  ASSERT_NE(reader, nullptr) << "its own it may read";
  SubscriberQos changed = partitioned;
  changed.partition().clear();
  changed.partition().push_back("gatefield/victim");
  EXPECT_EQ(subscriber->set_qos(changed), ReturnCode_t::RETCODE_OK);
  expect_unharmed(fly(victim_.get()));
  SubscriptionMatchedStatus matched;
  reader->get_subscription_matched_status(matched);
  wire::ThrustRateCommand sample;
  SampleInfo info;
  EXPECT_EQ(reader->take_next_sample(&sample, &info), ReturnCode_t::RETCODE_NO_DATA);
  subscriber->delete_datareader(reader);
  rival.participant()->raw()->delete_subscriber(subscriber);
  EXPECT_EQ(heard, 0);
}

// Fast DDS decrypts what is encrypted, and would take this as well: the guard in front of it doesn't let it by.
TEST_F(SecuredAttacks, PlainPacketsInAMembersNameAreDropped) {
  using namespace eprosima::fastdds::dds;
  const Credentials own = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger rival({}, &own);
  auto* const participant = rival.participant()->raw();
  auto* const topic = rival.participant()->topic(topic_name(Topic::kVehicleState),
                                                 TypeSupport(new WireType<wire::VehicleStatePubSubType>()));
  auto* const publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto* const writer = publisher->create_datawriter(topic, writer_qos(Topic::kVehicleState, {}));
  ASSERT_NE(writer, nullptr);
  PublicationMatchedStatus matched;
  for (int i = 0; i < 500 && matched.current_count == 0; ++i) {
    std::this_thread::sleep_for(10ms);
    writer->get_publication_matched_status(matched);
  }
  ASSERT_EQ(matched.current_count, 1) << "the server listens to its states";

  const PacketBytes packet = plain_state(writer->guid(), test::good_state("rival", 1));
  ASSERT_FALSE(packet.empty());
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) {
    if (sequence % 5 == 0) send_to_all(packet);
  }));
  EXPECT_NE(packets_told().find("it is not encrypted"), std::string::npos) << packets_told();
  EXPECT_EQ(told(), "") << "it came as far as the server's own checks";
  publisher->delete_datawriter(writer);
  participant->delete_publisher(publisher);
}

TEST_F(SecuredAttacks, AToolHearsEverythingAndSaysNothing) {
  const Credentials ear = credentials_of(keys(), Role::kTool, "ear");
  Stranger tool({}, &ear);  // reads requests
  EXPECT_NE(tool.overheard(), 0u);
  std::atomic<int> heard{0};
  Reader<wire::ThrustRateCommandPubSubType>::Callbacks hears;
  hears.sample = [&](wire::ThrustRateCommand*, const Origin&) { ++heard; };
  hears.unreadable = [] {};
  const auto commands =
      must(Reader<wire::ThrustRateCommandPubSubType>::open(tool.participant(), Topic::kCommand, hears, "gatefield/*"));
  for (int i = 0; i < 5 && heard == 0; ++i) expect_unharmed(fly(victim_.get()));
  EXPECT_GT(heard, 0);
  EXPECT_FALSE(Writer<wire::VehicleStatePubSubType>::open(tool.participant(), Topic::kVehicleState).ok());
  EXPECT_FALSE(Writer<wire::SessionReplyPubSubType>::open(tool.participant(), Topic::kSessionReply).ok());
}

}  // namespace
}  // namespace gatefield::dds
