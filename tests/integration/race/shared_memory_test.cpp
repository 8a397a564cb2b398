// Server and client that don't share /dev/shm, as in two containers on one host.

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace gatefield::test
