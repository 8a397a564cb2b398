// A server and its stand-by over the wire, as gatefield-server joins them, with stand-ins for planner and sensor.

#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "common/dds/server_endpoint.h"
#include "server/app/dds_transport.h"
#include "server/service/service.h"
#include "tests/support/dds_domain.h"
#include "tests/support/messages.h"
#include "tests/unit/server/service/fakes.h"

namespace gatefield::dds {
namespace {

using namespace std::chrono_literals;

/// A way out that can be closed for commands: the server hangs, as far as anybody hears.
class Gag final : public service::Transport {
 public:
  explicit Gag(service::Transport* to) : to_(to) {}
  void send(const protocol::SessionReply& reply) override { to_->send(reply); }
  bool send(const protocol::ThrustRateCommand& command) noexcept override { return closed || to_->send(command); }
  bool send(const protocol::Telemetry& telemetry) noexcept override { return to_->send(telemetry); }
  void forget(const std::string& vehicle) override { to_->forget(vehicle); }
  bool tell(const protocol::PilotRecord& record) override { return to_->tell(record); }
  Status follow(const std::string& vehicle, std::uint64_t request, std::uint32_t take_overs) override {
    return to_->follow(vehicle, request, take_overs);
  }
  std::atomic<bool> closed{false};

 private:
  service::Transport* const to_;
};

struct Server {
  Server(const std::string& name, const PartnerNames& partners) {
    service::ServiceOptions options;
    options.name = name;
    options.figures_period = 20ms;
    options.has_heir = !partners.heir.empty();
    options.stands_by = !partners.leader.empty();
    planner::Profile profile = service::testing::small_profile();
    profile.control_rate_hz = 50.0;
    options.profiles = {{"race", profile}};
    serving = std::make_unique<service::Service>(options, service::testing::fake_factories(), &clock, &gag);
    wire.attach(serving.get());
    auto made = ServerEndpoint::create(test::own_domain(), name, &wire, {}, partners);
    if (!made) throw std::runtime_error(made.error());
    endpoint = std::move(made).value();
    wire.attach(endpoint.get());
    serving->start();
  }
  ~Server() {
    serving->stop();
    endpoint.reset();
  }
  const MonotonicClock clock;
  app::DdsTransport wire;
  Gag gag{&wire};
  std::unique_ptr<service::Service> serving;
  std::unique_ptr<ServerEndpoint> endpoint;
};

bool eventually(const std::function<bool()>& condition, std::chrono::milliseconds limit = 20s) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

/// A vehicle that hovers and says so, 100 times a second.
class StandByOverTheWire : public ::testing::Test {
 protected:
  void SetUp() override {
    leader_ = std::make_unique<Server>("planner-1", PartnerNames{.heir = "planner-2"});
    heir_ = std::make_unique<Server>("planner-2", PartnerNames{.leader = "planner-1"});
    ASSERT_TRUE(eventually([&] { return leader_->serving->figures()->heir_there; }));
    sdk::Options options;
    options.domain = test::own_domain();
    options.vehicle = "drone";
    options.server = "planner-1";
    options.course = test::good_request().course;
    options.connect_timeout = 20s;
    auto client = sdk::Client::connect(options);
    ASSERT_TRUE(client.ok()) << client.error();
    client_ = std::move(client).value();
    session_ = client_->session();
    flying_ = std::thread([this] { fly(); });
    ASSERT_TRUE(eventually([&] { return commands_ > 5; }));
    ASSERT_TRUE(eventually([&] { return heir_->serving->figures()->stands_by_for == 1; }));
  }
  void TearDown() override {
    ends_ = true;
    if (flying_.joinable()) flying_.join();
    client_.reset();
    heir_.reset();
    leader_.reset();
  }
  void fly() {
    while (!ends_) {
      QuadrotorState state = test::good_state().state;
      state.p_WB = {0.0, 0.0, 1.5};
      state.v_WB.setZero();
      state.w_WB_B.setZero();
      state.q_WB.setIdentity();
      client_->send_state(MonotonicClock().now(), state);
      std::this_thread::sleep_for(10ms);
      while (const auto command = client_->newest()) {
        if (command->session != session_.session) strange_ = true;
        ++commands_;
      }
    }
  }
  /// The stand-by commands the vehicle, under the same session, and nobody else does.
  void expect_taken_over() {
    EXPECT_TRUE(eventually([&] { return heir_->serving->sessions() == 1; }));
    EXPECT_TRUE(eventually([&] { return client_->session().server == "planner-2"; }));
    EXPECT_EQ(client_->session().session, session_.session);
    EXPECT_TRUE(eventually([&] { return leader_->serving->sessions() == 0; })) << "one pilot";
    const int before = commands_;
    EXPECT_TRUE(eventually([&] { return commands_ > before + 20; })) << "it goes on";
    EXPECT_FALSE(strange_);
    EXPECT_EQ(client_->statistics().reconnects, 0u);
  }

  std::unique_ptr<Server> leader_, heir_;
  std::unique_ptr<sdk::Client> client_;
  protocol::SessionReply session_;
  std::thread flying_;
  std::atomic<bool> ends_{false}, strange_{false};
  std::atomic<int> commands_{0};
};

TEST_F(StandByOverTheWire, TheLeaderFliesAndNamesItsHeir) {
  EXPECT_NE(client_->session().heir, protocol::ParticipantBytes());
  const int before = commands_;
  EXPECT_TRUE(eventually([&] { return commands_ > before + 50; }));
  EXPECT_EQ(client_->session().server, "planner-1");
}

TEST_F(StandByOverTheWire, GoesOnWhenTheLeaderIsSilent) {
  leader_->gag.closed = true;
  expect_taken_over();
  leader_->gag.closed = false;
  EXPECT_EQ(client_->session().server, "planner-2") << "who took over keeps it";
}

TEST_F(StandByOverTheWire, GoesOnWhenTheLeaderIsDrained) {
  leader_->serving->drain();
  EXPECT_TRUE(eventually([&] { return leader_->serving->drained(); }));
  expect_taken_over();
}

TEST_F(StandByOverTheWire, GoesOnWhenTheLeaderEnds) {
  leader_->serving->stop();
  expect_taken_over();
}

TEST_F(StandByOverTheWire, ServesNewcomersWhenTheLeaderIsGone) {
  leader_->serving->stop();
  leader_->endpoint.reset();
  sdk::Options options;
  options.domain = test::own_domain();
  options.vehicle = "another";
  options.course = test::good_request().course;
  options.connect_timeout = 20s;
  const auto client = sdk::Client::connect(options);
  ASSERT_TRUE(client.ok()) << client.error();
  EXPECT_EQ(client.value()->session().server, "planner-2");
}

}  // namespace
}  // namespace gatefield::dds
