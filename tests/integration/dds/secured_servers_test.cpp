// The column "with security" of docs/security.md: members that pass themselves off as a server that they aren't.

#include <atomic>
#include <string>
#include <thread>

#include "tests/integration/dds/other_server.h"
#include "tests/integration/dds/secured_flight.h"

namespace gatefield::dds {
namespace {

using SecuredServers = SecuredFlight;

TEST_F(SecuredServers, AServerOfAnotherNameIsNotBelieved) {
  const Credentials second = credentials_of(keys(), Role::kServer, "planner-2");
  Stranger server({}, &second);
  auto replies = server.writer<wire::SessionReplyPubSubType>(Topic::kSessionReply);
  for (int i = 0; i < 500 && replies->readers() == 0; ++i) std::this_thread::sleep_for(10ms);
  constexpr std::uint64_t kForged = 666;
  const auto forge = [&](std::uint64_t sequence) {
    protocol::SessionReply reply = test::good_reply("victim", server.overheard());
    reply.server = kServer;
    reply.session = kForged;
    if (sequence % 2 == 1) {  // or sends it away
      reply.accepted = false;
      reply.reason = "the server is leaving";
      reply.code = ErrorCode::kLeaving;
    }
    replies->write([&](auto* sample) { to_wire(reply, sample); });
  };
  expect_unharmed(fly(victim_.get(), forge));
  // Nor when its own server goes: an open domain's vehicle takes another acceptance then.
  service_->stop();
  endpoint_.reset();
  for (std::uint64_t i = 0; i < 100; ++i) {
    forge(i);
    std::this_thread::sleep_for(25ms);
    ASSERT_NE(victim_->session().session, kForged);
  }
}

TEST_F(SecuredServers, CommandsOfAnotherServerAreDroppedAndCounted) {
  const Credentials second = credentials_of(keys(), Role::kServer, "planner-2");
  Stranger server({}, &second);
  auto commands = server.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  ASSERT_TRUE(within_5s([&] { return commands->readers() > 0; })) << "it may command everybody";
  const std::uint64_t session = victim_->session().session;
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t sequence) { say(commands.get(), session, sequence); }));
  EXPECT_GT(victim_->statistics().rejected, 10u);
}

TEST_F(SecuredServers, AServersNameIsItsCertificates) {
  const std::string words = "gatefield-server:planner-2:serving";
  const Credentials other = credentials_of(keys(), Role::kServer, "planner-3");
  const Credentials vehicle = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger outsider(words), server(words, &other), member(words, &vehicle);
  TransportOptions options;
  options.network.security = security(Role::kServer, "planner-2");
  OtherServer handler;
  const auto second = must(ServerEndpoint::create(own_domain(), "planner-2", &handler, options));
  const auto met = [&](Stranger* who) {
    return within_5s([&] { return who->met().contains("gatefield-server:planner-2:serving"); });
  };
  EXPECT_TRUE(met(&server) && met(&member)) << "they take part";
  std::this_thread::sleep_for(500ms);
  EXPECT_EQ(handler.namesakes, 0) << "nobody else is of that name";
  OtherServer twin_handler;
  const auto twin = must(ServerEndpoint::create(own_domain(), "planner-2", &twin_handler, options));
  EXPECT_TRUE(within_5s([&] { return handler.namesakes == 1; })) << "but who has its certificate";
  expect_unharmed(fly(victim_.get()));
}

/// The server was told of a stand-by.
class SecuredPair : public SecuredFlight {
  PartnerNames partners() const override { return {.heir = "planner-2"}; }
};

TEST_F(SecuredPair, TheHeirHasTheHeirsCertificate) {
  const std::string words = std::string("gatefield-server:planner-2:standby-of:") + kServer;
  const Credentials other = credentials_of(keys(), Role::kServer, "planner-3");
  const Credentials vehicle = credentials_of(keys(), Role::kVehicle, "rival");
  Stranger outsider(words), server(words, &other), member(words, &vehicle);
  server.server(kServer);
  member.server(kServer);
  expect_unharmed(fly(victim_.get()));
  EXPECT_EQ(victim_->session().heir, protocol::ParticipantBytes()) << "words make nobody an heir";
  const Credentials own = credentials_of(keys(), Role::kServer, "planner-2");
  Stranger heir(words, &own);
  EXPECT_TRUE(within_5s([&] { return victim_->session().heir != protocol::ParticipantBytes(); }));
}

TEST_F(SecuredPair, AnotherServersWordThatItFliesTheVehicleIsDropped) {
  const Credentials other = credentials_of(keys(), Role::kServer, "planner-3");
  Stranger server(std::string("gatefield-server:planner-2:standby-of:") + kServer, &other);
  auto records = server.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const ParticipantId to = server.server(kServer);
  ASSERT_TRUE(within_5s([&] { return records->readers() > 0; })) << "servers hear each other";
  const auto taken = record_of("victim", victim_->session().session, service_->session_of("victim")->request().request,
                               protocol::PilotRecord::Kind::kTaken);
  expect_unharmed(fly(victim_.get(), [&](std::uint64_t) { say(records.get(), taken, to); }));
  EXPECT_NE(service_->session_of("victim"), nullptr);
  EXPECT_NE(told_of(Topic::kPilotRecord), "");
}

TEST_F(SecuredServers, AnotherServersRecordsAndCommandsAreNotFollowed) {
  std::atomic<std::uint64_t> dropped{0};
  TransportOptions options;
  options.network.security = security(Role::kServer, "planner-2");
  options.on_samples_dropped = [&](const DroppedSamples& told) { dropped += told.count; };
  OtherServer handler;
  const auto stand_by = must(ServerEndpoint::create(own_domain(), "planner-2", &handler, options, {.leader = kServer}));
  ASSERT_TRUE(within_5s([&] { return handler.leaders == 1; }));
  const Credentials other = credentials_of(keys(), Role::kServer, "planner-3");
  Stranger server(std::string("gatefield-server:") + kServer + ":serving", &other);
  auto records = server.writer<wire::PilotRecordPubSubType>(Topic::kPilotRecord);
  const auto commands =
      server.writer<wire::ThrustRateCommandPubSubType>(Topic::kCommand, 1000, command_partition("victim"));
  const ParticipantId to = server.server("planner-2");
  ASSERT_TRUE(within_5s([&] { return records->readers() > 0 && commands->readers() > 0; }));
  const std::uint64_t session = victim_->session().session;
  const auto give = record_of("victim", session, service_->session_of("victim")->request().request,
                              protocol::PilotRecord::Kind::kHandOver);
  const auto attack = [&](std::uint64_t sequence) {
    say(records.get(), give, to);
    say(commands.get(), session, sequence);
  };
  expect_unharmed(fly(victim_.get(), attack));
  // On a busy machine the stand-by and the leader's encrypted commands are still finding each other.
  for (int turn = 0; turn < 5 && handler.commands <= 10; ++turn) expect_unharmed(fly(victim_.get(), attack));
  EXPECT_EQ(handler.records, 0);
  EXPECT_GT(dropped, 0u);
  EXPECT_EQ(handler.forged_commands, 0);
  EXPECT_GT(handler.commands, 10) << "the leader's commands are heard";
}

}  // namespace
}  // namespace gatefield::dds
