// Vehicles behind a rate loop that is another thing than what the planner reckons with: lockstep races with the learned
// field, over DDS.

#include <gtest/gtest.h>

#include "tests/integration/race/programs.h"

namespace gatefield::test {
namespace {

using namespace std::chrono_literals;
using ::testing::Test;

class Rates : public Test {
 protected:
  /// A lap of the circle. @return what the simulator said
  std::string won(const std::vector<std::string>& extra) {
    std::vector<std::string> arguments{"--scenario", "circle-0.3m", "--laps", "1", "--lockstep"};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    Process sim = programs_.simulator("sim" + std::to_string(++flown_) + ".log", arguments);
    EXPECT_EQ(sim.wait(100s).value_or(-1), 0) << sim.output() << server_.output();
    return sim.output();
  }
  Programs programs_{"rates"};
  Process server_ = programs_.server("server.log");
  int flown_ = 0;
};

bool told(const std::string& output, const std::string& problem) { return output.find(problem) != std::string::npos; }

TEST_F(Rates, ALapIsWonAsTold) {
  const std::string output = won({"--actuation", "body-rates", "--speed", "10"});
  EXPECT_TRUE(told(output, "body rates"));
  EXPECT_FALSE(told(output, "thrust_unlike_told")) << output;
  EXPECT_FALSE(told(output, "rate_loop_unlike_told")) << output;
  EXPECT_TRUE(told(output, "of what is asked for; rates ")) << "what was found in flight:\n" << output;
}

TEST_F(Rates, ThrustUnlikeToldIsFoundAndSaid) {
  const std::string output = won({"--actuation", "body-rates", "--speed", "8", "--thrust-factor", "1.25"});
  EXPECT_TRUE(told(output, "thrust_unlike_told") || told(output, "more or less thrust than it is asked for")) << output;
}

TEST_F(Rates, ARateLoopUnlikeToldIsFoundAndSaid) {
  const std::string output = won({"--actuation", "body-rates", "--speed", "8", "--rate-loop-factor", "2"});
  EXPECT_TRUE(told(output, "rate_loop_unlike_told") || told(output, "body rates follow their command")) << output;
}

TEST_F(Rates, AVehicleOfLittleThrustIsFlown) { won({"--vehicle", "heavy-rates", "--speed", "6"}); }

}  // namespace
}  // namespace gatefield::test
