// A leader whose cable is pulled out in mid-race, its stand-by on another host. Needs root.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/integration/race/programs.h"
#include "tests/support/network_space.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// Three hosts, each on a subnet of its own, with a router between them that hands on no multicast.
class CutCable : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!NetworkSpace::permitted()) GTEST_SKIP() << "this machine gives its users no network namespaces (ip netns add)";
    router_ = std::make_unique<NetworkSpace>("gf-rt");
    int subnet = 0;
    for (auto& [host, name] : {std::pair(&leader_host_, "gf-lead"), {&heir_host_, "gf-heir"}, {&field_, "gf-fld"}}) {
      const std::string net = "10.83." + std::to_string(++subnet) + ".";
      *host = std::make_unique<NetworkSpace>(name);
      (*host)->connect(*router_, "eth0", net + "2/24", "port" + std::to_string(subnet), net + "1/24");
      (*host)->configure("route add default via " + net + "1");
    }
    router_->route();
  }
  /// With the others' addresses.
  std::unique_ptr<Process> start(const NetworkSpace& host, const std::string& program,
                                 std::vector<std::string> arguments, const std::string& log) const {
    for (const char* other : {"10.83.1.2:0-2", "10.83.2.2:0-2", "10.83.3.2:0-2"})
      arguments.insert(arguments.end(), {"--peer", other});
    return std::make_unique<Process>(host.run((kPrograms / program).string(), arguments, programs_.file(log)));
  }
  std::unique_ptr<Process> server(const NetworkSpace& host, const std::string& name, const std::string& other) const {
    auto arguments = programs_.server_arguments();
    arguments.insert(arguments.end(), {"--name", name, "--standby", other, "--standby-of", other});
    return start(host, "gatefield-server", arguments, name + ".log");
  }

  Programs programs_{"cut-cable"};
  std::unique_ptr<NetworkSpace> router_, leader_host_, heir_host_, field_;
};

TEST_F(CutCable, TheStandByFliesOnAndWhoIsBackLetsGo) {
  const auto leader = server(*leader_host_, "a", "b"), heir = server(*heir_host_, "b", "a");
  ASSERT_TRUE(leader->wait_for_output("the stand-by is there", 60s)) << leader->output();
  ASSERT_TRUE(heir->wait_for_output("the leader is there", 60s)) << heir->output();
  // Which of the two answers first flies; it has the other one to stand by.
  const auto sim = start(*field_, "gatefield-sim",
                         {"--domain", programs_.domain(), "--scenario", "circle-0.3m", "--seed", "6", "--speed", "6",
                          "--laps", "4", "--realtime"},
                         "sim.log");
  const auto logs = [&] {
    return "---- a\n" + leader->output() + "---- b\n" + heir->output() + "---- simulator\n" + sim->output();
  };
  ASSERT_TRUE(sim->wait_for_output("lap 1 of ", 60s)) << logs();
  const auto stands_by = [](const Process& one) {
    return one.output().find("stands by for session") != std::string::npos;
  };
  for (int i = 0; i < 100 && !stands_by(*leader) && !stands_by(*heir); ++i) std::this_thread::sleep_for(100ms);
  ASSERT_NE(stands_by(*leader), stands_by(*heir)) << logs();
  const bool first_flies = stands_by(*heir);
  Process& gone = first_flies ? *leader : *heir;
  Process& stays = first_flies ? *heir : *leader;
  const std::string port = first_flies ? "port1" : "port2";

  router_->configure("link set " + port + " down");
  EXPECT_TRUE(stays.wait_for_output("takes over session", 10s)) << logs();
  std::this_thread::sleep_for(3s);
  router_->configure("link set " + port + " up");
  EXPECT_TRUE(gone.wait_for_output(" ended, ", 20s)) << logs();
  EXPECT_EQ(sim->wait(120s).value_or(-1), 0) << logs();
  EXPECT_EQ(sim->output().find("Reconnected"), std::string::npos) << logs();
}

}  // namespace
}  // namespace gatefield::test
