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

TEST_F(Rates, ALimitOfRatesIsFoundAndSaidAndReadFromTheRecording) {
  const std::string csv = programs_.file("flight.csv").string();
  const std::string output = won({"--actuation", "body-rates", "--speed", "6", "--rate-limit", "1.5", "--csv", csv});
  EXPECT_TRUE(told(output, "rate_limit_unlike_told") || told(output, "stay at a limit below")) << output;
  Process identify((kPrograms / "gatefield-identify").string(), {csv, "--vehicle", "racer-rates"},
                   programs_.file("identify.log"));
  ASSERT_EQ(identify.wait(30s).value_or(-1), 0) << identify.output();
  const std::string lines = identify.output();
  const std::size_t at = lines.find("body_rate_max_rad_s {");
  ASSERT_NE(at, std::string::npos) << lines;
  const double pitch_rad_s = std::stod(lines.substr(lines.find("y: ", at) + 3));
  EXPECT_NEAR(pitch_rad_s, 1.5, 0.15) << lines;
}

TEST_F(Rates, AVehicleOfLittleThrustIsFlown) { won({"--vehicle", "heavy-rates", "--speed", "6"}); }

}  // namespace
}  // namespace gatefield::test
