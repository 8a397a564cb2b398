// A race in a world that is harder than the planner is told, in lockstep over DDS, with the learned field alone.

#include <gtest/gtest.h>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;

TEST(HardWorld, ALapIsWonAndFliesTheSameAgain) {
  Programs programs("hard-world");
  Process server = programs.server("server.log");
  const auto fly = [&](const std::string& name, const std::string& world) {
    Process sim = programs.simulator(name + ".log", {"--scenario", "circle-0.3m", "--seed", "1", "--laps", "1",
                                                     "--speed", "7", "--lockstep", "--world", world});
    EXPECT_EQ(sim.wait(100s).value_or(-1), 0) << sim.output() << server.output();
    return sim.output();
  };
  const auto line_of = [](const std::string& output, const std::string& word) {
    const std::size_t at = output.find(word);
    return at == std::string::npos ? "" : output.substr(at, output.find('\n', at) - at);
  };
  const std::string hard = fly("hard", "hard"), again = fly("again", "hard");
  EXPECT_EQ(line_of(hard, "World "), "World         hard") << hard;
  EXPECT_NE(line_of(hard, "Lap times"), "");
  for (const std::string word : {"Result", "Lap times", "Speed", "Clearance"})
    EXPECT_EQ(line_of(hard, word), line_of(again, word));
}

}  // namespace
}  // namespace gatefield::test
