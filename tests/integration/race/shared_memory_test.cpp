// Server and client that don't share /dev/shm, as in two containers on one host, and a server that leaves things there.

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

/// A shell that sees an empty /dev/shm of its own.
Process apart(const std::string& command, const std::filesystem::path& log) {
  return Process("/usr/bin/unshare",
                 {"--user", "--map-root-user", "--mount", "/bin/sh", "-c",
                  "mount -t tmpfs none /dev/shm && [ -z \"$(ls -A /dev/shm)\" ] && exec " + command},
                 log);
}

TEST(SharedMemory, ServerAndClientNeedNone) {
  Programs programs("containers");
  Process trial = apart("/bin/true", programs.file("trial.log"));
  if (trial.wait(10s).value_or(-1) != 0)
    GTEST_SKIP() << "this machine gives no mount namespace to its users: " << trial.output();

  std::string server_command = (kPrograms / "gatefield-server").string();
  for (const std::string& argument : programs.server_arguments()) server_command += " '" + argument + "'";
  Process server = apart(server_command, programs.file("server.log"));
  ASSERT_TRUE(server.wait_for_output("ready: server", 60s)) << server.output();
  Process sim = apart((kPrograms / "gatefield-sim").string() + " --domain " + programs.domain() +
                          " --scenario circle-0.3m --laps 1 --seed 1 --speed 6",
                      programs.file("sim.log"));
  EXPECT_EQ(sim.wait(120s).value_or(-1), 0) << sim.output() << server.output();
}

/// A server that is killed leaves its segments, which nobody else may touch while it lives.
TEST(SharedMemory, WhatAKilledServerLeftIsRemovedByTheNextOne) {
  Programs programs("segments");
  Process trial = apart("/bin/true", programs.file("trial.log"));
  if (trial.wait(10s).value_or(-1) != 0)
    GTEST_SKIP() << "this machine gives no mount namespace to its users: " << trial.output();
  std::string server = (kPrograms / "gatefield-server").string() + " --shared-memory";
  for (const std::string& argument : programs.server_arguments()) server += " " + argument;
  const std::filesystem::path script = programs.file("script.sh");
  std::ofstream(script) << "until_ready() { until grep -q 'ready: server' \"$1\"; do sleep 0.1; done; }\n"
                        << server << " >\"$1/first\" 2>&1 & until_ready \"$1/first\"; kill -9 $!; wait $! 2>/dev/null\n"
                        << "echo \"left $(ls -A /dev/shm | wc -l)\"\n"
                        << server << " >\"$1/second\" 2>&1 & until_ready \"$1/second\"; kill $!; wait $! 2>/dev/null\n"
                        << "echo \"left $(ls -A /dev/shm | wc -l)\"\n";
  Process both = apart("/bin/sh " + script.string() + " " + script.parent_path().string(), programs.file("both.log"));
  EXPECT_EQ(both.wait(120s).value_or(-1), 0) << both.output();
  int killed = 0, after = -1;
  ASSERT_EQ(std::sscanf(both.output().c_str(), "left %d left %d", &killed, &after), 2) << both.output();
  EXPECT_GT(killed, 0);
  EXPECT_EQ(after, 0);
}

}  // namespace
}  // namespace gatefield::test
