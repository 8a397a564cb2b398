// Servers and clients on networks where multicast does not get: each "host" is a network namespace. Needs root.

#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "tests/integration/race/programs.h"
#include "tests/support/network_space.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

class Networks : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!NetworkSpace::permitted()) GTEST_SKIP() << "this machine gives its users no network namespaces (ip netns add)";
  }
  Process server(const NetworkSpace& host, const std::vector<std::string>& extra, const std::string& log = "server") {
    auto arguments = programs_.server_arguments();
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return host.run((kPrograms / "gatefield-server").string(), arguments, programs_.file(log));
  }
  Process client(const NetworkSpace& host, const std::vector<std::string>& extra) const {
    std::vector<std::string> arguments{"--domain", programs_.domain(), "--width", "320", "--height",
                                       "180",      "--rate",           "30"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    return host.run(CAMERA_PROGRAM, arguments, programs_.file("client.log"));
  }
  /// Joins, sends depth and states for two seconds. @return how many plans came back; -1: it did not join
  int fly(const NetworkSpace& host, std::vector<std::string> extra) {
    extra.insert(extra.end(), {"--seconds", "2"});
    Process camera = client(host, extra);
    const int code = camera.wait(60s).value_or(-1);
    said_ = camera.output();
    int commands = 0;
    if (code != 0 || std::sscanf(said_.c_str(), "joined heard %d commands", &commands) != 1) return -1;
    return commands;
  }

  Programs programs_{"networks"};
  std::string said_;  ///< by the client
};

/// Two subnets with a router between them, which hands on no multicast.
struct TwoSubnets {
  NetworkSpace pit{"gf-pit"}, router{"gf-rt"}, field{"gf-fld"};
  TwoSubnets() {
    pit.connect(router, "eth0", "10.81.1.2/24", "pit0", "10.81.1.1/24");
    field.connect(router, "eth0", "10.81.2.2/24", "field0", "10.81.2.1/24");
    router.route();
    pit.configure("route add default via 10.81.1.1");
    field.configure("route add default via 10.81.2.1");
  }
};

TEST_F(Networks, RoutedSubnetsMeetByAPeersAddress) {
  TwoSubnets net;
  Process planner = server(net.pit, {});
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  EXPECT_EQ(fly(net.field, {"--wait", "2"}), -1) << "they meet without being told";
  EXPECT_GT(fly(net.field, {"--peer", "10.81.1.2:0-3"}), 20) << said_ << planner.output();
}

TEST_F(Networks, RoutedSubnetsMeetThroughADiscoveryServer) {
  TwoSubnets net;
  Process planner = server(net.pit, {"--discovery-listen", "11811"});
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  EXPECT_GT(fly(net.field, {"--discovery-server", "10.81.1.2:11811"}), 20) << said_ << planner.output();
}

TEST_F(Networks, ADiscoveryServerThatIsKilledAndStartedAgainIsFoundAgain) {
  TwoSubnets net;
  const std::vector<std::string> listens{"--discovery-listen", "11811"};
  auto first = std::make_unique<Process>(server(net.pit, listens));
  ASSERT_TRUE(first->wait_for_output("ready: server", 60s)) << first->output();
  Process camera = client(net.field, {"--discovery-server", "10.81.1.2:11811"});
  ASSERT_TRUE(camera.wait_for_output("joined", 20s)) << camera.output() << first->output();
  first->signal(SIGKILL);
  ASSERT_TRUE(first->wait(10s));
  Process second = server(net.pit, listens, "second");
  EXPECT_TRUE(second.wait_for_output("drone", 30s)) << "the client does not join again\n" << second.output();
}

constexpr int kVpnMtu_bytes = 1280;

/// One end of a VPN over the routed subnets: a device from point to point, without multicast, with room for less than
/// the network that carries it.
class VpnEnd {
 public:
  VpnEnd(NetworkSpace* host, const std::string& own, const std::string& other, const std::string& carried_to,
         const std::filesystem::path& log) {
    host->configure("tuntap add dev vpn0 mode tun");
    host->configure("addr add " + own + " peer " + other + " dev vpn0");
    host->configure("link set vpn0 mtu " + std::to_string(kVpnMtu_bytes) + " multicast off up");
    tunnel_.emplace(host->run(TUNNEL_PROGRAM, {"--device", "vpn0", "--to", carried_to, "--allowed", other}, log));
    EXPECT_TRUE(tunnel_->wait_for_output("up", 10s)) << tunnel_->output();
  }
  /// Ends it. @return packets that it carried, and the size of the largest
  std::pair<int, int> carried() {
    std::pair<int, int> said{-1, -1};
    tunnel_->signal(SIGTERM);
    EXPECT_EQ(tunnel_->wait(10s).value_or(-1), 0) << tunnel_->output();
    EXPECT_EQ(std::sscanf(tunnel_->output().c_str(), "up carried %d packets, the largest of %d bytes", &said.first,
                          &said.second),
              2)
        << tunnel_->output();
    return said;
  }

 private:
  std::optional<Process> tunnel_;
};

TEST_F(Networks, AVpnCarriesAFlight) {
  TwoSubnets net;
  if (!net.pit.may_have("tuntap add dev try0 mode tun")) GTEST_SKIP() << "this machine has no tun devices";
  VpnEnd pit(&net.pit, "10.82.0.1", "10.82.0.2", "10.81.2.2", programs_.file("pit-vpn"));
  VpnEnd field(&net.field, "10.82.0.2", "10.82.0.1", "10.81.1.2", programs_.file("field-vpn"));
  Process planner = server(net.pit, {"--interface", "vpn0"});
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  EXPECT_EQ(fly(net.field, {"--interface", "vpn0", "--wait", "2"}), -1) << "they meet without being told";
  EXPECT_GT(fly(net.field, {"--interface", "vpn0", "--peer", "10.82.0.1"}), 20) << said_ << planner.output();
  for (VpnEnd* end : {&pit, &field}) {
    const auto [packets, largest_bytes] = end->carried();
    EXPECT_GT(packets, 500) << "states, depth in pieces and plans of two seconds";
    EXPECT_LE(largest_bytes, kVpnMtu_bytes);
    EXPECT_GT(largest_bytes, 1000) << "depth goes through in pieces as large as it takes";
  }
}

TEST_F(Networks, AnInterfaceThatIsNotThereIsNamedBesideThoseThatAre) {
  NetworkSpace pit("gf-pit");
  Process planner = server(pit, {"--interface", "eth7"});
  EXPECT_EQ(planner.wait(30s).value_or(-1), 3);
  EXPECT_NE(planner.output().find("network.interfaces is 'eth7', expected one with an IPv4 address: lo 127.0.0.1"),
            std::string::npos)
      << planner.output();
}

/// A program of ours with variables in its environment.
Process in_environment(std::vector<std::string> variables, const std::string& program,
                       const std::vector<std::string>& arguments, const std::filesystem::path& log) {
  variables.push_back(program);
  variables.insert(variables.end(), arguments.begin(), arguments.end());
  return Process("/usr/bin/env", variables, log);
}

TEST(SharedMemory, OfAnotherContainerGivesWayToUdp) {
  Programs programs("containers");
  // As in a container: a /dev/shm of its own on the same host, and the same interfaces.
  const std::string camera = std::string(CAMERA_PROGRAM) + " --domain " + programs.domain() +
                             " --width 320 --height 180 --seconds 2 --shared-memory";
  const auto apart = [&](const std::string& command, const std::string& log) {
    return Process(
        "/usr/bin/unshare",
        {"--user", "--map-root-user", "--mount", "/bin/sh", "-c", "mount -t tmpfs none /dev/shm && exec " + command},
        programs.file(log));
  };
  Process trial = apart("/bin/true", "trial.log");
  if (trial.wait(10s).value_or(-1) != 0) GTEST_SKIP() << "no mount namespaces here: " << trial.output();
  Process planner = programs.server("server.log", {"--shared-memory"});
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  Process elsewhere = apart(camera, "elsewhere.log");
  EXPECT_EQ(elsewhere.wait(60s).value_or(-1), 0);
  int commands = 0;
  EXPECT_EQ(std::sscanf(elsewhere.output().c_str(), "joined heard %d commands", &commands), 1) << elsewhere.output();
  EXPECT_GT(commands, 20) << planner.output();
}

TEST(Surroundings, ProfilesAreNamedAndNotHeededAndADiscoveryServerIsTaken) {
  Programs programs("surroundings");
  const std::string port = std::to_string(20000 + own_domain());
  auto arguments = programs.server_arguments();
  arguments.insert(arguments.end(), {"--discovery-listen", port});
  Process planner = in_environment({"FASTRTPS_DEFAULT_PROFILES_FILE=/nowhere/profiles.xml", "FASTDDS_STATISTICS=ALL"},
                                   (kPrograms / "gatefield-server").string(), arguments, programs.file("server.log"));
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  const std::string said = planner.output();
  EXPECT_NE(said.find("FASTRTPS_DEFAULT_PROFILES_FILE is set (/nowhere/profiles.xml) and not read"), std::string::npos)
      << said;
  EXPECT_NE(said.find("FASTDDS_STATISTICS is set (ALL) and not heeded"), std::string::npos) << said;

  // A profile that asks for protection is no wish to fly without.
  std::ofstream(programs.file("secure.xml")) << "<property><name>dds.sec.auth.plugin</name></property>";
  Process unprotected =
      in_environment({"FASTRTPS_DEFAULT_PROFILES_FILE=" + programs.file("secure.xml").string()},
                     (kPrograms / "gatefield-server").string(), programs.server_arguments(), programs.file("secure"));
  EXPECT_EQ(unprotected.wait(60s).value_or(-1), 2) << unprotected.output();
  EXPECT_NE(unprotected.output().find("asks for DDS security"), std::string::npos) << unprotected.output();

  const std::vector<std::string> camera{"--domain", programs.domain(), "--width", "160",    "--height",
                                        "90",       "--seconds",       "1",       "--wait", "20"};
  Process client =
      in_environment({"ROS_DISCOVERY_SERVER=127.0.0.1:" + port}, CAMERA_PROGRAM, camera, programs.file("client.log"));
  EXPECT_EQ(client.wait(60s).value_or(-1), 0) << client.output() << planner.output();
  Process broken =
      in_environment({"ROS_DISCOVERY_SERVER=udp://pit"}, CAMERA_PROGRAM, camera, programs.file("broken.log"));
  EXPECT_EQ(broken.wait(60s).value_or(-1), 3);
  EXPECT_NE(broken.output().find("ROS_DISCOVERY_SERVER is 'udp://pit', expected HOST or HOST:PORT"), std::string::npos)
      << broken.output();
}

}  // namespace
}  // namespace gatefield::test
