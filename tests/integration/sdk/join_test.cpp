#include <gatefield/sdk/client.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/dds/client_endpoint.h"
#include "tests/integration/sdk/scripted_server.h"
#include "tests/support/dds_domain.h"

namespace gatefield::sdk {
namespace {

using test::accept_as;
using test::own_domain;
using test::ScriptedServer;

std::unique_ptr<ScriptedServer> server() {
  return std::make_unique<ScriptedServer>("planner-1", accept_as(50), [](const protocol::VehicleState&) {
    return std::optional<protocol::ThrustRateCommand>();
  });
}

Options options(const std::string& vehicle) {
  Options options;
  options.domain = own_domain();
  options.vehicle = vehicle;
  options.course = test::good_request().course;
  options.timing = protocol::Timing::kLockstep;
  return options;
}

// GATEFIELD_JOINS sets how often each of the two joins; 1000 take about four minutes.
TEST(Join, SucceedsAlwaysWhileAnotherClientComesAndGoes) {
  const char* const asked = std::getenv("GATEFIELD_JOINS");
  const int joins = asked != nullptr ? std::atoi(asked) : 100;
  const auto planner = server();
  std::vector<std::string> failures[2];
  std::vector<double> took_s[2];
  std::thread clients[2];
  for (std::size_t k = 0; k < 2; ++k)
    clients[k] = std::thread([&, k] {
      for (int i = 0; i < joins; ++i) {
        const Stamp start = MonotonicClock().now();
        const auto client = Client::connect(options("drone-" + std::to_string(k)));
        took_s[k].push_back(seconds(MonotonicClock().now() - start));
        if (!client.ok()) failures[k].push_back("join " + std::to_string(i) + ": " + client.error());
      }
    });
  for (std::thread& client : clients) client.join();

  for (std::size_t k = 0; k < 2; ++k) {
    for (const std::string& failure : failures[k]) ADD_FAILURE() << "client " << k << ", " << failure;
    std::sort(took_s[k].begin(), took_s[k].end());
    std::printf("client %zu: %d joins, median %.0f ms, longest %.0f ms\n", k, joins,
                1e3 * took_s[k][took_s[k].size() / 2], 1e3 * took_s[k].back());
  }
}

// Why: common/dds/qos.h.
TEST(Join, NothingGoesThroughSharedMemory) {
  const auto planner = server();
  const auto client = Client::connect(options("drone"));
  ASSERT_TRUE(client.ok()) << client.error();
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    EXPECT_EQ(line.find("/dev/shm/fastrtps"), std::string::npos) << line;
}

// UDP ports that sockets of this process are bound to.
std::set<int> own_ports() {
  std::set<std::string> own;
  for (const auto& file : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const std::string name = std::filesystem::read_symlink(file.path(), gone).string();
    if (name.rfind("socket:[", 0) == 0) own.insert(name.substr(8, name.size() - 9));
  }
  std::set<int> ports;
  std::ifstream sockets("/proc/self/net/udp");
  std::string line;
  std::getline(sockets, line);  // the heading
  while (std::getline(sockets, line)) {
    char inode[32] = {};
    unsigned port = 0;
    if (std::sscanf(line.c_str(), "%*s %*8x:%4x %*s %*s %*s %*s %*s %*s %*s %31s", &port, inode) == 2 &&
        own.contains(inode))
      ports.insert(static_cast<int>(port));
  }
  return ports;
}

// A participant beyond the domain's ports would hear, and be heard by, the members of the next domain.
TEST(Join, PortsStayInTheDomainHoweverManyCameBefore) {
  struct Nobody : dds::ClientHandler {
    void on_reply(const protocol::SessionReply&, const dds::ParticipantId&) override {}
    void on_command(const protocol::ThrustRateCommand&, const dds::ParticipantId&) override {}
    void on_telemetry(const protocol::Telemetry&) override {}
    void on_rejected(dds::Topic, const std::string&) override {}
  } nobody;
  for (int i = 0; i < 130; ++i) ASSERT_TRUE(dds::ClientEndpoint::create(own_domain(), "drone", &nobody).ok());
  const auto endpoint = dds::ClientEndpoint::create(own_domain(), "drone", &nobody);
  ASSERT_TRUE(endpoint.ok()) << endpoint.error();

  const int first = 7400 + 250 * static_cast<int>(own_domain());
  std::set<int> listening = own_ports();
  std::erase_if(listening, [](int port) { return port >= 32768; });  // where sending sockets are put
  EXPECT_EQ(listening.count(first), 1u);
  EXPECT_EQ(listening.size(), 3u) << "the domain's, the participant's for discovery and for samples";
  for (const int port : listening) EXPECT_TRUE(first <= port && port < first + 250) << port;
}

}  // namespace
}  // namespace gatefield::sdk
