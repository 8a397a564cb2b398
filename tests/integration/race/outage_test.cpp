// What happens when a side goes away in mid-race.

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

TEST(Outage, AServerKilledInMidRaceIsJoinedAgainAndTheRaceGoesOn) {
  Programs programs("outage");
  Process server = programs.server("server1.log");
  Process sim =
      programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--seed", "1", "--speed", "5", "--realtime"});
  ASSERT_TRUE(sim.wait_for_output("lap 1 of 3 begins", 30s)) << sim.output() << server.output();
  std::this_thread::sleep_for(3s);
  server.signal(SIGKILL);
  ASSERT_EQ(server.wait(2s).value_or(-1), 128 + SIGKILL);
  std::this_thread::sleep_for(700ms);  // longer than any plan: the vehicle is on its own for a while
  Process again = programs.server("server2.log");
  const auto code = sim.wait(120s);
  EXPECT_EQ(code.value_or(-1), 0) << sim.output() << again.output();
  EXPECT_NE(sim.output().find("Reconnected   1 times"), std::string::npos) << sim.output();
}

TEST(Outage, AClientGoneWithoutGoodbyeFreesItsName) {
  Programs programs("gone");
  Process server = programs.server("server.log");
  const std::vector<std::string> arguments{"--scenario", "circle-0.3m", "--seed", "1",   "--speed",
                                           "6",          "--realtime",  "--name", "solo"};
  Process first = programs.simulator("sim1.log", arguments);
  ASSERT_TRUE(first.wait_for_output("lap 1 of 3 begins", 30s)) << first.output() << server.output();
  std::this_thread::sleep_for(1s);
  first.signal(SIGKILL);
  ASSERT_TRUE(first.wait(2s).has_value());
  Process second = programs.simulator("sim2.log", {"--scenario", "circle-0.3m", "--seed", "2", "--speed", "7",
                                                   "--lockstep", "--laps", "1", "--name", "solo"});
  EXPECT_EQ(second.wait(90s).value_or(-1), 0) << second.output() << server.output();
}

TEST(Outage, AnInterruptedRaceLeavesWholeFilesAndExitsAtOnce) {
  Programs programs("interrupt");
  Process server = programs.server("server.log");
  Process sim = programs.simulator("sim.log", {"--scenario", "circle-0.3m", "--seed", "1", "--realtime", "--csv",
                                               programs.file("run.csv").string()});
  ASSERT_TRUE(sim.wait_for_output("lap 1 of 3 begins", 30s)) << sim.output() << server.output();
  std::this_thread::sleep_for(1s);
  sim.signal(SIGINT);
  EXPECT_EQ(sim.wait(2s).value_or(-1), 0) << sim.output();
  EXPECT_GT(std::filesystem::file_size(programs.file("run.csv")), 1000u);
  server.signal(SIGINT);
  EXPECT_EQ(server.wait(2s).value_or(-1), 0) << server.output();
}

}  // namespace
}  // namespace gatefield::test
