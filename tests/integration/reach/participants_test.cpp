// Many participants on several hosts find one server, each of which would be alone in its host's ports. Needs root.
// GATEFIELD_PARTICIPANTS sets how many (long checks); a few are enough to see that it works.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <vector>

#include "tests/integration/race/programs.h"
#include "tests/support/network_space.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

constexpr int kHosts = 3;

int resident_mb(pid_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/status");
  for (std::string word; in >> word;)
    if (int kb = 0; word == "VmRSS:" && in >> kb) return kb / 1024;
  return 0;
}

TEST(Participants, OfSeveralHostsAreAllAnswered) {
  if (!NetworkSpace::permitted()) GTEST_SKIP() << "this machine gives its users no network namespaces (ip netns add)";
  const char* const asked = std::getenv("GATEFIELD_PARTICIPANTS");
  const int each = (asked != nullptr ? std::atoi(asked) : 15) / kHosts;
  Programs programs("participants");
  NetworkSpace pit("gf-pit");
  std::vector<std::unique_ptr<NetworkSpace>> hosts;
  for (int i = 0; i < kHosts; ++i) {
    const std::string subnet = "10.83." + std::to_string(i) + ".";
    hosts.push_back(std::make_unique<NetworkSpace>("gf-h" + std::to_string(i)));
    hosts.back()->connect(pit, "eth0", subnet + "2/24", "host" + std::to_string(i), subnet + "1/24");
    hosts.back()->configure("route add default via " + subnet + "1");
  }
  pit.route();
  auto arguments = programs.server_arguments();
  // One place: that the others are refused is an answer, too.
  arguments.insert(arguments.end(), {"--discovery-listen", "11811", "--max-vehicles", "1"});
  Process planner = pit.run((kPrograms / "gatefield-server").string(), arguments, programs.file("server.log"));
  ASSERT_TRUE(planner.wait_for_output("ready: server", 60s)) << planner.output();
  const int before_mb = resident_mb(planner.pid());
  std::vector<std::unique_ptr<Process>> callers;
  for (int i = 0; i < kHosts; ++i)
    callers.push_back(std::make_unique<Process>(hosts[static_cast<std::size_t>(i)]->run(
        CALLERS_PROGRAM,
        {"--domain", programs.domain(), "--count", std::to_string(each), "--name", "h" + std::to_string(i) + "-",
         "--wait", "200", "--stay", "3", "--discovery-server", "10.83." + std::to_string(i) + ".1:11811"},
        programs.file("callers" + std::to_string(i)))));
  int most_mb = before_mb;
  for (const auto& caller : callers) {
    EXPECT_TRUE(caller->wait_for_output("answered", 220s)) << caller->output();
    most_mb = std::max(most_mb, resident_mb(planner.pid()));
  }
  for (const auto& caller : callers) {
    EXPECT_EQ(caller->wait(30s).value_or(-1), 0) << caller->output();
    std::printf("%s", caller->output().c_str());
  }
  std::printf("the server had %d MB before and %d MB with %d participants\n", before_mb, most_mb, kHosts * each);
  EXPECT_TRUE(planner.running()) << planner.output();
}

}  // namespace
}  // namespace gatefield::test
