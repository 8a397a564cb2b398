// What the service refuses, over the wire: also to a client that speaks version 1.

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <mutex>
#include <string>
#include <vector>

#include "common/dds/client_endpoint.h"
#include "common/dds/participant.h"
#include "common/dds/reader.h"
#include "common/dds/server_endpoint.h"
#include "gatefield_idl/gatefieldPubSubTypes.h"
#include "server/app/dds_transport.h"
#include "server/service/service.h"
#include "tests/integration/dds/raw_type.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"
#include "tests/support/wire_bytes.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;

/// SessionReply as a client of version 1 reads it: that version's fields, and nothing behind them.
class ReplyOfVersion1 final : public WireType<wire::SessionReplyPubSubType> {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    try {
      eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload->data), payload->length);
      eprosima::fastcdr::Cdr in(buffer, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR);
      in.read_encapsulation();
      auto& reply = *static_cast<wire::SessionReply*>(data);
      reply = wire::SessionReply();
      std::string vehicle, reason, server;
      in >> reply.version() >> vehicle >> reply.request() >> reply.accepted() >> reason >> server >> reply.session() >>
          reply.control_period_s() >> reply.plan_step_s() >> reply.plan_steps() >> reply.model_hash();
      reply.vehicle() = vehicle.c_str();
      reply.reason() = reason.c_str();
      reply.server() = server.c_str();
      return true;
    } catch (...) {
      return false;
    }
  }
};

/// The service with stand-ins for planner and sensor, joined to the wire as gatefield-server does it.
class Refusals : public ::testing::Test {
 public:
  Refusals() {
    service::ServiceOptions options;
    options.name = "planner-1";
    options.profiles = {{"race", service::testing::small_profile()}};
    service_ = std::make_unique<service::Service>(options, service::testing::fake_factories(), &clock_, &transport_);
    transport_.attach(service_.get());
    auto endpoint = ServerEndpoint::create(test::own_domain(), "planner-1", &transport_);
    EXPECT_TRUE(endpoint.ok()) << endpoint.error();
    endpoint_ = std::move(endpoint).value();
    transport_.attach(endpoint_.get());
    service_->start();
  }
  ~Refusals() override {
    service_->stop();
    endpoint_.reset();
  }
  void heard(const std::function<void()>& change) {
    {
      const std::lock_guard lock(mutex_);
      change();
    }
    changed_.notify_all();
  }
  template <typename Condition>
  bool wait(Condition&& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, 10s, condition);
  }

  MonotonicClock clock_;
  app::DdsTransport transport_;
  std::unique_ptr<service::Service> service_;
  std::unique_ptr<ServerEndpoint> endpoint_;
  std::mutex mutex_;
  std::condition_variable changed_;
};

TEST_F(Refusals, AClientOfVersion1IsToldInItsOwnVersion) {
  using namespace eprosima::fastdds::dds;
  auto opened = Participant::open(test::own_domain(), "version 1", "", {}, [](const PeerEvent&) {});
  ASSERT_TRUE(opened.ok()) << opened.error();
  const auto client = std::move(opened).value();
  std::vector<wire::SessionReply> replies;
  auto reader = Reader<wire::SessionReplyPubSubType, ReplyOfVersion1>::open(
      client.get(), Topic::kSessionReply,
      {[&](wire::SessionReply* reply, const Origin&) { heard([&] { replies.push_back(*reply); }); }, nullptr, [] {}});
  ASSERT_TRUE(reader.ok()) << reader.error();

  using Raw = RawType<wire::SessionRequestPubSubType>;
  auto* const topic = client->topic(topic_name(Topic::kSessionRequest), TypeSupport(new Raw()));
  auto* const publisher = client->raw()->create_publisher(PUBLISHER_QOS_DEFAULT);
  auto* const writer = publisher->create_datawriter(topic, writer_qos(Topic::kSessionRequest, {}));
  ASSERT_NE(writer, nullptr);
  Raw::bytes = test::wire_bytes("session_request_version_1");
  wire::SessionRequest key;
  key.vehicle() = "drone";
  ASSERT_TRUE(writer->write(&key));

  const bool answered = wait([&] { return !replies.empty(); });
  publisher->delete_datawriter(writer);
  client->raw()->delete_publisher(publisher);
  ASSERT_TRUE(answered);
  const wire::SessionReply& reply = replies[0];
  EXPECT_EQ(reply.version(), 1u) << "of another version it would not read on";
  EXPECT_EQ(std::string(reply.vehicle().c_str()), "drone");
  EXPECT_EQ(reply.request(), 7u);
  EXPECT_FALSE(reply.accepted());
  EXPECT_EQ(std::string(reply.reason().c_str()), "version is 1, expected 2 (the protocol version of this program)");
  EXPECT_EQ(std::string(reply.server().c_str()), "planner-1");
  EXPECT_EQ(reply.session(), 0u);
}

TEST_F(Refusals, CarryCodeFieldValueAndRange) {
  struct Client final : ClientHandler {
    Refusals* test = nullptr;
    std::vector<protocol::SessionReply> replies;
    void on_reply(const protocol::SessionReply& reply, const ParticipantId&) override {
      test->heard([&] { replies.push_back(reply); });
    }
    void on_command(const protocol::ThrustRateCommand&, const ParticipantId&) override {}
    void on_telemetry(const protocol::Telemetry&) override {}
    void on_rejected(Topic, const std::string& reason) override { ADD_FAILURE() << reason; }
  } heard_by;
  heard_by.test = this;
  auto client = ClientEndpoint::create(test::own_domain(), "drone", &heard_by);
  ASSERT_TRUE(client.ok()) << client.error();
  protocol::SessionRequest request = test::good_request();
  request.profile = "drift";
  ASSERT_TRUE(client.value()->publish(request).ok());
  ASSERT_TRUE(wait([&] { return !heard_by.replies.empty(); }));
  const protocol::SessionReply& reply = heard_by.replies[0];
  EXPECT_FALSE(reply.accepted);
  EXPECT_EQ(reply.version, protocol::kVersion);
  EXPECT_EQ(reply.code, ErrorCode::kUnknownName);
  EXPECT_EQ(reply.field, "profile");
  EXPECT_EQ(reply.value, "\"drift\"");
  EXPECT_EQ(reply.expected, "one of: race");
  EXPECT_EQ(reply.reason, "profile is \"drift\", expected one of: race");
}

}  // namespace
}  // namespace gatefield::dds
